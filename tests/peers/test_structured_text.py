"""The translator of Structured Text: what it makes computes what the text says, and what it refuses."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.peers.references import IN_ST
from tests.peers.structured_text import SyntaxFault, parse, translate

RIG = """
PROGRAM RIG
VAR_EXTERNAL
  COUNT : INT;
  RESULT : DWORD;
  BEFORE : UDINT;
  AFTER : UDINT;
  STEPS : UDINT;
  SIGNED : DINT;
  BITS : UDINT;
  BACK : DINT;
END_VAR
VAR
  CHECK : CRC32;
END_VAR
  CHECK(FIRST := 0, COUNT := COUNT, SO_FAR := DWORD#16#00000000);
  RESULT := CHECK.CRC;
  STEPS := STEPS_BETWEEN(BEFORE := BEFORE, AFTER := AFTER);
  BITS := BITS_OF(NUMBER := SIGNED);
  BACK := I32_OF(NUMBER := BITS);
END_PROGRAM
CONFIGURATION BENCH
  VAR_GLOBAL
    REGISTERS : REGISTERS_T;
    COUNT : INT;
    RESULT : DWORD;
    BEFORE : UDINT;
    AFTER : UDINT;
    STEPS : UDINT;
    SIGNED : DINT;
    BITS : UDINT;
    BACK : DINT;
  END_VAR
END_CONFIGURATION
"""
WORD = st.integers(0, 0xFFFF)
U32 = st.integers(0, 2**32 - 1)


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    if shutil.which("gcc") is None:
        pytest.skip("NOT TESTED: the translator of Structured Text: gcc is missing (Debian: apt install gcc)")
    folder = tmp_path_factory.mktemp("rig")
    text = "\n".join(
        (IN_ST / f"{name}.st").read_text(encoding="utf-8") for name in ("types", "words", "crc32")
    )
    (folder / "rig.c").write_text(translate(parse(text + RIG)), encoding="utf-8")
    words = ["gcc", "-std=gnu11", "-Wall", "-Wextra", "-Werror", "-Wno-unused-function", "-shared", "-fPIC"]
    subprocess.run([*words, "-o", folder / "rig.so", folder / "rig.c", "-lm"], check=True)
    library = ctypes.CDLL(str(folder / "rig.so"))
    library.plc_init()
    return library


@given(registers=st.lists(WORD, min_size=1, max_size=121))
def test_the_crc_of_the_plc_program_is_that_of_zlib(rig: ctypes.CDLL, registers: list[int]) -> None:
    image = (ctypes.c_uint16 * 400).in_dll(rig, "plc_REGISTERS")
    image[: len(registers)] = registers
    ctypes.c_int16.in_dll(rig, "plc_COUNT").value = len(registers)
    rig.plc_run()
    packed = b"".join(word.to_bytes(2, "big") for word in registers)
    assert ctypes.c_uint32.in_dll(rig, "plc_RESULT").value == zlib.crc32(packed)


@given(before=U32, after=U32, signed=st.integers(-(2**31), 2**31 - 1))
def test_counters_that_wrap_and_signed_words(rig: ctypes.CDLL, before: int, after: int, signed: int) -> None:
    ctypes.c_uint32.in_dll(rig, "plc_BEFORE").value = before
    ctypes.c_uint32.in_dll(rig, "plc_AFTER").value = after
    ctypes.c_int32.in_dll(rig, "plc_SIGNED").value = signed
    rig.plc_run()
    assert ctypes.c_uint32.in_dll(rig, "plc_STEPS").value == (after - before) % 2**32
    assert ctypes.c_uint32.in_dll(rig, "plc_BITS").value == signed % 2**32
    assert ctypes.c_int32.in_dll(rig, "plc_BACK").value == signed


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("A := B;", "UINT stands where INT should"),
        ("A := C;", "LREAL stands where INT should"),
        ("A := 40000;", "40000 is no INT"),
        ("A := A + B;", "UINT stands where INT should"),
        ("A := D;", "D is not declared"),
        ("A := F(1);", "there is no function F"),
        ("IF A THEN A := 1; END_IF;", "INT stands where BOOL should"),
        ("K := 3;", "K is constant"),
        ("A := 1", "';' should stand"),
        ("A := A AND A;", "AND does not go with INT"),
        ("A := ?;", "no word of the language"),
        ("FROM := 1;", "a name should stand"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_line(body: str, said: str) -> None:
    text = f"""PROGRAM P
VAR
  A : INT;
  B : UINT;
  C : LREAL;
END_VAR
VAR CONSTANT
  K : INT := 2;
END_VAR
{body}
END_PROGRAM
CONFIGURATION X
END_CONFIGURATION
"""
    with pytest.raises(SyntaxFault, match=r"^line 1[01]: ") as fault:
        translate(parse(text))
    assert said in str(fault.value)
