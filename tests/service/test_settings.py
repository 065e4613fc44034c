import pytest
from pydantic import ValidationError

from service.settings import Settings


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.4", "::"])
def test_an_address_beyond_loopback_is_refused(host):
    with pytest.raises(ValidationError, match="not a loopback address"):
        Settings(host=host)


@pytest.mark.parametrize("host", ["127.0.0.1", "127.0.0.9", "::1", "localhost"])
def test_loopback_addresses_are_taken(host):
    assert Settings(host=host).host == host


def test_the_environment_sets_what_it_names(monkeypatch):
    monkeypatch.setenv("ROBOCAL_LEASE_S", "2.5")
    assert Settings().lease_s == 2.5
