"""The key with which tests call the service; `tests/conftest.py` puts it into the environment.

Every `Settings()` of a test, in this process or in one that it starts, knows the key by that.
"""

KEY = "key-of-the-tests-0123456789-0123456789"
SETTING = "ROBOCAL_BOOTSTRAP_KEY"
PASSWORD = "measure twice, cut once"
BEARER = {"Authorization": f"Bearer {KEY}"}
