# SPDX-License-Identifier: MIT
"""Parameter file of a controller: order of its numbers, and faults by their keys."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.errors import InputError
from drivetwin.files.calibration_file import build_user_controller, load_controller_file

TABLE = """source = "a.c"
oil_temperature_C = 90
[[parameters]]
name = "gain"
unit = "bar*s/rad"
start = 2.0
low = 1.0
high = 3.0
free = false
[[parameters]]
name = "release"
unit = "bar"
axis = "time"
axis_unit = "s"
breakpoints = [0.0, 0.5]
start = [8.0, 4.0]
low = 0.0
high = [10.0, 6.0]
"""


def write(folder: Path, text: str) -> Path:
    path = folder / "controller.toml"
    path.write_text(text)
    return path


def test_numbers_are_in_the_order_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "a.c").touch()
    content = load_controller_file(write(tmp_path, TABLE))
    built = build_user_controller(content, tmp_path / "a.so")
    assert built.numbers == (2.0, 0.0, 0.5, 8.0, 4.0)
    assert built.places == (0, 3, 4)
    assert [one.name for one in built.parameters] == ["gain", "release[0]", "release[0.5]"]
    assert [one.high for one in built.parameters] == [3.0, 10.0, 6.0]
    assert [one.free for one in built.parameters] == [False, True, True]
    assert built.oil_temperature == pytest.approx(363.15)
    assert built.fill([1.0, 7.0, 3.0]) == (1.0, 0.0, 0.5, 7.0, 3.0)


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("[0.0, 0.5]", "[0.5, 0.5]", "parameters.1.breakpoints"),
        ("[8.0, 4.0]", "[8.0]", "parameters.1.start"),
        ('"release"', '"gain"', "parameters.1.name"),
        ('"gain"', '"a gain"', "name"),
        ("= 2.0", "= 'x'", "start"),
        ('source = "a.c"\n', "", "source"),
    ],
)
def test_faults_name_their_key(tmp_path: Path, old: str, new: str, key: str) -> None:
    with pytest.raises(InputError) as error:
        load_controller_file(write(tmp_path, TABLE.replace(old, new, 1)))
    assert key in str(error.value)
