"""What the model gets wrong, its physical cause, the extended model, and what that gains."""
