"""Commands as a person types them."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from hvcpd.control.cli import main

Ran = Callable[..., str]
Refuse = Callable[..., str]


@pytest.fixture
def ran(capsys: pytest.CaptureFixture[str]) -> Ran:
    """Run `hvcpctl` with good input: exit status 0; its standard output."""

    def run(*arguments: object) -> str:
        assert main([str(argument) for argument in arguments]) == 0
        return capsys.readouterr().out

    return run


@pytest.fixture
def refused(capsys: pytest.CaptureFixture[str]) -> Refuse:
    """Run `hvcpctl` with bad input: exit status 2, nothing on standard output, no traceback; what it said."""

    def run(*arguments: object) -> str:
        try:
            status: object = main([str(argument) for argument in arguments])
        except SystemExit as end:  # argparse's way
            status = end.code
        out, err = capsys.readouterr()
        assert status == 2
        assert out == ""
        assert "Traceback" not in err
        assert "hvcpctl" in err
        return err

    return run
