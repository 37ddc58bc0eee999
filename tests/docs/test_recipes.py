"""The recipes of CONTRIBUTING.md work: each adds its thing to a copy of hvcpd, in at most three files."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

Recipe = dict[str, tuple[str, str]]
"""By file: what stands there, and what takes its place; for a new file "" and its text."""

SENTENCE: Recipe = {
    "language/messages.py": (
        "@dataclass(frozen=True)\nclass WhoHere:",
        '@dataclass(frozen=True)\nclass HowFar:\n    """How far has the addressee driven?"""\n\n\n'
        "@dataclass(frozen=True)\nclass WhoHere:",
    ),
    "language/forms.py": (
        "_QUESTIONS: tuple[tuple[str, type[m.Statement], str], ...] = (",
        "_QUESTIONS: tuple[tuple[str, type[m.Statement], str], ...] = (\n"
        '    (f"how far did you drive {PLEASE}", m.HowFar, "How far have you driven?"),',
    ),
    "coordination/commands.py": (
        "REACTIONS: Reactions = {",
        'REACTIONS: Reactions = {\n    m.HowFar: _answering("far", composing.occupation),',
    ),
}
VOICE: Recipe = {
    "synthesis/voices.py": (
        '    Voice("willow"',
        '    Voice("fir", 125.0, 1.12, 1.0, -36.0, 0.58, 3000.0),\n    Voice("willow"',
    ),
    "config/names.py": ('"willow"]', '"willow", "fir"]'),
}
DRIVER: Recipe = {
    "hardware/wheels_tracked.py": (
        "",
        '"""A tracked base."""\n\nfrom hvcpd.ports import WheelReading\n\n\nclass TrackedWheels:\n'
        "    def open(self): print('opened')\n    def exchange(self, command): return WheelReading(1.0, 1.0)\n"
        "    def close(self): print('closed')\n",
    ),
    "config/settings.py": ('"ros", "none"] = "auto"', '"ros", "none", "tracked"] = "auto"'),
    "daemon/devices.py": (
        '    if settings.driver == "ros":',
        '    if settings.driver == "tracked":\n        from hvcpd.hardware.wheels_tracked import TrackedWheels\n\n'
        '        return TrackedWheels()\n    if settings.driver == "ros":',
    ),
}
MOTOR: Recipe = {
    "hardware/motors.py": ('Model("XL430-W250", 38)}', 'Model("XL430-W250", 38), 1070: Model("Sister", 40)}')
}

IS_FROM_THE_COPY = "import hvcpd\nassert hvcpd.__file__.startswith({copy!r}), hvcpd.__file__\n"

CHECKS = {
    "sentence": (
        SENTENCE,
        "from hvcpd.language import messages as m\n"
        "from hvcpd.language.card import make_card\n"
        "from tests.coordination.mission import Mission, plants\n"
        "mission = Mission(('Rob', 'Bot'), plants(2), seed=1)\n"
        "asked = mission.book.parse_text('Rob, how far did you drive')\n"
        "assert isinstance(asked.statement, m.HowFar) and mission.book.parse(mission.book.render(asked)) == asked\n"
        "assert 'how far did you drive' in str(make_card(mission.book))\n"
        "for at_s in (20.0, 30.0, 45.0):  # one or the other may meet another's sentence\n"
        "    mission.hear(at_s, 'rob how far did you drive')\n"
        "mission.run()\n"
        "assert any('completing' in line or 'am free' in line for line in mission.written()), mission.written()\n",
    ),
    "voice": (
        VOICE,
        "from pathlib import Path\n"
        "from hvcpd.config.settings_file import load_settings\n"
        "from hvcpd.assembly.sound import make_sound\n"
        "from hvcpd.synthesis.speaker import Speaker\n"
        "from hvcpd.synthesis.voices import voice_named\n"
        "none = Path('none.yaml')\n"
        "assert load_settings(None, {'name': 'Rob', 'voice': 'fir'}, system_path=none).voice == 'fir'\n"
        "lexicon = make_sound(None, None).lexicon\n"
        "said = [Speaker(voice_named(name), lexicon).render((('stop',),)) for name in ('fir', 'oak')]\n"
        "assert abs(said[0]).max() > 0.05 and len(said[0]) > 1600 and said[0].tobytes() != said[1].tobytes()\n",
    ),
    "driver": (
        DRIVER,
        "from pathlib import Path\n"
        "from hvcpd.config.settings_file import load_settings\n"
        "from hvcpd.daemon.devices import make_wheels\n"
        "none = Path('none.yaml')\n"
        "settings = load_settings(None, {'name': 'Rob', 'wheels.driver': 'tracked'}, system_path=none)\n"
        "assert type(make_wheels(settings.wheels)).__name__ == 'TrackedWheels'\n"
        "Path('tracked.yaml').write_text('name: Rob\\nwheels: {driver: tracked}\\n')\n"
        "from contextlib import redirect_stdout\n"
        "from io import StringIO\n"
        "from hvcpd.control.cli import main\n"
        "for action in ('status', 'stop'):\n"
        "    with redirect_stdout(StringIO()) as out:\n"
        "        assert main(['drive', action, '--config', 'tracked.yaml']) == 0\n"
        "    assert 'opened' in out.getvalue() and 'closed' in out.getvalue()\n"
        "from hvcpd.control.doctor.doctor import look_at_wheels\n"
        "from hvcpd.daemon.preflight import find_port\n"
        "assert find_port(settings.wheels, Path('nowhere')).text == 'by the driver tracked'\n"
        "assert all(found.ok for found in look_at_wheels(settings.wheels))\n",
    ),
    "motor": (
        MOTOR,
        "from hil_fakes.virtual_robot import VirtualRobot\n"
        "robot = VirtualRobot()\n"
        "for motor in robot.motors:\n"
        "    motor.memory.set('model_number', 1070)\n"
        "    motor.memory.set('firmware_version', 39)\n"
        "from hvcpd.errors import DeviceError\n"
        "try:\n    robot.wheels.open()\n"
        "except DeviceError as error:\n    assert 'update it to 40' in str(error), error\n"
        "else:\n    raise AssertionError('old firmware is refused')\n"
        "for motor in robot.motors:\n    motor.memory.set('firmware_version', 40)\n"
        "robot.wheels.open()\n",
    ),
}


@pytest.mark.parametrize("name", CHECKS)
def test_a_first_change_works_in_at_most_three_files(name: str, tmp_path: Path) -> None:
    recipe, check = CHECKS[name]
    assert len(recipe) <= 3
    shutil.copytree(ROOT / "hvcpd", tmp_path / "hvcpd", copy_function=os.link)
    for file, (old, new) in recipe.items():
        path = tmp_path / "hvcpd" / file
        text = path.read_text(encoding="utf-8") if old else ""
        assert text.count(old) == 1 or not old, f"CONTRIBUTING's recipe no longer fits {file}"
        path.unlink(missing_ok=True)  # a link: the tree itself stays as it is
        path.write_text(text.replace(old, new) if old else new, encoding="utf-8")
    script = IS_FROM_THE_COPY.format(copy=str(tmp_path)) + check
    paths = os.pathsep.join((str(tmp_path), str(ROOT)))
    environment = {**os.environ, "PYTHONPATH": paths, "OPENBLAS_NUM_THREADS": "1"}
    result = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stderr
