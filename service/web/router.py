"""The pages for the operator; mounted at the root of the service."""

from fastapi import APIRouter

router = APIRouter(include_in_schema=False)
