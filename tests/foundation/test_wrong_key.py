"""A check on a whole table names the key at fault: its own, not a word of its message."""

from __future__ import annotations

from pathlib import Path
from typing import Self

import pytest
from pydantic import Field, model_validator

from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.settings.loading import Settings, load_settings
from bufferstand.foundation.settings.wrong_key import WrongKeyError


class Wire(Settings):
    length_mm: float
    name: str = ""


class Stand(Settings):
    name: str = ""
    low_mm: float = 0.0
    high_mm: float = 1.0
    wire: list[Wire] = Field(default_factory=list)

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.low_mm > self.high_mm:
            raise WrongKeyError("the name of the error is low above high; lower it", "low_mm", "high_mm")
        for number, wire in enumerate(self.wire):
            if wire.length_mm < 0.0:
                raise WrongKeyError("a length below zero; measure it", ("wire", number, "length_mm"))
        return self


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ('name = "x"\nlow_mm = 5.0\nhigh_mm = 2.0', "line 2: low_mm"),
        ('name = "x"\nlow_mm = 5.0', "line 2: low_mm"),
        ('name = "x"\n\nhigh_mm = -2.0', "line 3: high_mm"),
        ('[[wire]]\nlength_mm = 1.0\n[[wire]]\nname = "b"\nlength_mm = -1.0', "line 5: wire.length_mm"),
    ],
)
def test_the_key_at_fault_is_the_one_that_is_written(tmp_path: Path, text: str, place: str) -> None:
    """A word of the message that happens to be a key as well (here: name) is none."""
    file = tmp_path / "x.toml"
    file.write_text(text)
    with pytest.raises(BadInput) as caught:
        load_settings(file, Stand)
    assert caught.value.place == place


def test_without_any_of_its_keys_the_table_is_named() -> None:
    assert WrongKeyError("neither", "low_mm", "high_mm").place({}) == ()
