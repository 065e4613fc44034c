import pytest
from pydantic import ValidationError

from service.settings import PLAINTEXT_WORD, Settings


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.4", "::"])
def test_an_address_beyond_loopback_needs_tls_or_the_word(host, tmp_path):
    with pytest.raises(ValidationError, match="plain text"):
        Settings(host=host)
    with pytest.raises(ValidationError, match="plaintext_beyond_loopback"):
        Settings(host=host, plaintext_beyond_loopback="yes")
    assert Settings(host=host, plaintext_beyond_loopback=PLAINTEXT_WORD).host == host
    files = {"tls_cert": tmp_path / "cert.pem", "tls_key": tmp_path / "key.pem"}
    with pytest.raises(ValidationError, match="file"):
        Settings(host=host, **files)
    for file in files.values():
        file.touch()
    assert Settings(host=host, **files).host == host
    with pytest.raises(ValidationError, match="together"):
        Settings(tls_cert=files["tls_cert"])


def test_open_access_is_for_this_machine_alone():
    assert Settings(access="open").access == "open"
    for more in ({"host": "192.168.1.4"}, {"hosts": ("cal.plant",)}):
        with pytest.raises(ValidationError, match="this machine alone"):
            Settings(access="open", plaintext_beyond_loopback=PLAINTEXT_WORD, **more)


def test_a_name_is_no_address_to_listen_on():
    with pytest.raises(ValidationError, match=r"cal\.plant"):
        Settings(host="cal.plant")


def test_secrets_are_not_shown_with_the_settings():
    shown = Settings(bootstrap_key="s3cret" * 8, tls_key_password="s3cret")
    assert "s3cret" not in repr(shown) + str(shown.model_dump())


@pytest.mark.parametrize("host", ["127.0.0.1", "127.0.0.9", "::1", "localhost"])
def test_loopback_addresses_are_taken(host):
    assert Settings(host=host).host == host


def test_the_environment_sets_what_it_names(monkeypatch):
    monkeypatch.setenv("ROBOCAL_LEASE_S", "2.5")
    assert Settings().lease_s == 2.5
