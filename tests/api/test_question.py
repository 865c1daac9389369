"""A verb's options are declared once: its command line, its function in Python and its checks say the same."""

import argparse
import inspect
import pickle
from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest

import ridelog
from logger.api.drive_questions import ModesQuestion, RandomRoadQuestion
from logger.commands import options
from logger.commands.main import ASKED
from logger.errors import BadInput
from logger.question import (
    Argument,
    Asking,
    Notify,
    Option,
    Question,
    Range,
    Switches,
    Verb,
    Verbs,
    askings,
    function,
    help_of,
    silent,
)


def _pair(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    if not value:
        raise ValueError("expected NAME=NUMBER")
    return name, float(value)


@dataclass(frozen=True)
class Ask(Question):
    """How it rides.

      ridelog ride road.csv

    In Python: the same.
    """

    road: Annotated[Path, Argument("the road", metavar="ROAD", read=Path)]
    _: KW_ONLY
    rate_hz: Annotated[float, Option("samples a second", Range(10, 1000, "Hz"), "HZ")] = 100.0
    tries: Annotated[int, Option("so many", Range(0, 9), "N")] = 0
    speeds_mps: Annotated[list[float] | tuple[float, ...], Option(
        "of a drive; may repeat", Range(1, 50, "m/s"), "MPS", read=float, many=list, flag="--speed")] = ()
    start: Annotated[Mapping[str, float] | None, Option("from where", read=_pair, many=dict)] = None
    surface: Annotated[str, Switches("of what it is", choices=("dry", "wet", "icy"), by_value={
        "wet": ("wet-road", "it rains"), "icy": ("ice", "it is cold")})] = "dry"
    kind: Annotated[str, Option("of model", choices=("ar", "ma"))] = "ar"
    quick: Annotated[bool, Option("be quick")] = False
    notify: Annotated[Notify, "called with what is under way"] = silent


def asked(*words: str) -> Question:
    parser = argparse.ArgumentParser(exit_on_error=False)
    verb = Verb(Ask, "")
    options.declare(parser, verb)
    with options.respelled(Ask):
        return options.asked(verb, parser.parse_args(words))


def test_a_command_line_makes_the_question_that_python_makes() -> None:
    assert asked("a.csv") == Ask(Path("a.csv"))
    assert asked("a.csv", "--rate", "50", "--tries", "3", "--speed", "10", "--speed", "20", "--start", "m=3",
                 "--start", "k=4", "--ice", "--kind", "ma", "--quick") == Ask(
        Path("a.csv"), rate_hz=50.0, tries=3, speeds_mps=[10.0, 20.0], start={"m": 3.0, "k": 4.0},
        surface="icy", kind="ma", quick=True)


@pytest.mark.parametrize(("words", "values", "complaint"), [
    (["--rate", "5"], {"rate_hz": 5}, "{} 5: expected 10 to 1000 Hz"),
    (["--rate", "nan"], {"rate_hz": float("nan")}, "{} nan: expected 10 to 1000 Hz"),
    (["--tries", "10"], {"tries": 10}, "{} 10: expected 0 to 9"),
    (["--speed", "9", "--speed", "90"], {"speeds_mps": [9.0, 90.0]}, "{} 90: expected 1 to 50 m/s"),
    (["--kind", "x"], {"kind": "x"}, "{} x: expected one of ar, ma"),
])
def test_what_is_out_of_range_is_one_sentence_in_both(words: list[str], values: dict[str, Any], complaint: str) -> None:
    with pytest.raises(BadInput) as there:
        asked("a.csv", *words)
    with pytest.raises(BadInput) as here:
        Ask(Path("a.csv"), **values)
    assert str(there.value) == complaint.format(words[0]) and str(here.value) == complaint.format(*values)


@pytest.mark.parametrize(("words", "complaint"), [
    (["--rate", "30mph"], "--rate 30mph: expected a number in Hz, without its unit"),
    (["--tries", "1.5"], "--tries 1.5: expected a whole number"),
    (["--start", "m"], "--start m: expected NAME=NUMBER")])
def test_what_cannot_be_read_is_named(words: list[str], complaint: str) -> None:
    with pytest.raises(BadInput, match=f"^{complaint}$"):
        asked("a.csv", *words)


def test_of_two_switches_one_would_be_lost() -> None:
    with pytest.raises(BadInput, match="--wet-road: expected no --ice with it"):
        asked("a.csv", "--wet-road", "--ice")


def test_the_function_has_the_questions_fields_and_words() -> None:
    @function(Ask)
    def ride(question: Ask) -> Ask:
        return question

    assert ride(Path("a.csv"), tries=2) == Ask(Path("a.csv"), tries=2)
    assert list(inspect.signature(ride).parameters) == [*(one.name for one in askings(Ask)), "notify"]
    assert ride.__name__ == "ride" and "samples a second (10 to 1000 Hz; default: 100)" in str(ride.__doc__)


def every_option() -> list[tuple[str, Asking]]:
    asked = {verb: options.named(f"logger.{place}") for verb, place in ASKED.items()}
    return [(verb, one) for verb, found in asked.items()
            for verbs in [[below for below, _ in found.below.values()] if isinstance(found, Verbs) else [found]]
            for each in verbs for one in askings(each.question)]


def test_each_option_is_explained_and_each_number_has_its_unit() -> None:
    assert not [(verb, one.name) for verb, one in every_option() if not one.option.help]
    units = {"_hz": "Hz", "_mps": "m/s", "_mps2": "m/s2", "_m": "m"}
    assert not [(verb, one.name) for verb, one in every_option() for end, unit in units.items()
                if one.name.endswith(end) and one.option.range and one.option.range.unit != unit]


def test_a_function_is_found_where_it_stands() -> None:
    verbs = [one for one in map(ridelog.__getattr__, ridelog.__all__) if hasattr(one, "__signature__")]
    assert len(verbs) >= 15 and all(pickle.loads(pickle.dumps(one)) is one for one in verbs)


@pytest.mark.parametrize(("values", "options", "words"), [
    ((Path("a.csv"),), {"trys": 3}, r"ride\(\) got an unexpected keyword argument 'trys'"),
    ((Path("a.csv"), 3), {}, r"ride\(\) too many positional arguments"),
    ((), {}, r"ride\(\) missing a required argument: 'road'")])
def test_python_names_the_function(values: tuple[Any, ...], options: dict[str, Any], words: str) -> None:
    @function(Ask)
    def ride(question: Ask) -> Ask:
        return question

    with pytest.raises(TypeError, match=f"^{words}"):
        ride(*values, **options)


def test_the_terminal_shows_the_help_without_the_part_on_python() -> None:
    assert "ridelog modes push.csv" in help_of(ModesQuestion) and "In Python" not in help_of(ModesQuestion)
    assert "default: ." not in "".join(one.help for _, one in every_option())


@pytest.mark.parametrize(("values", "complaint"), [
    ({"rate_hz": "50.2"}, "rate_hz '50.2': expected a number in Hz"),
    ({"rate_hz": [50.0]}, "rate_hz [50.0]: expected a number in Hz"),
    ({"rate_hz": None}, "rate_hz None: expected a number in Hz"),
    ({"rate_hz": True}, "rate_hz True: expected a number in Hz"),
    ({"tries": 1.5}, "tries 1.5: expected a whole number"),
    ({"speeds_mps": 8.0}, "speeds_mps 8.0: expected a list of numbers in m/s"),
    ({"speeds_mps": [8.0, "9"]}, "speeds_mps [8.0, '9']: expected a list of numbers in m/s"),
    ({"speeds_mps": "89"}, "speeds_mps '89': expected a list of numbers in m/s"),
    ({"start": {"m": "1"}}, "start {'m': '1'}: expected a dict of numbers"),
    ({"kind": None}, "kind None: expected one of ar, ma"),
    ({"kind": ["ar"]}, "kind ['ar']: expected one of ar, ma"),
    ({"quick": 1}, "quick 1: expected True or False"),
    ({"road": 3}, "road 3: expected a path"),
    ({"road": Range(0, 1)}, "road of type Range: expected a path"),
    ({"notify": None}, "notify None: expected a function"),
])
def test_a_value_of_another_kind_is_one_sentence(values: dict[str, Any], complaint: str) -> None:
    with pytest.raises(BadInput) as error:
        Ask(**{"road": Path("a.csv"), **values})
    assert str(error.value) == complaint


def test_numbers_of_numpy_are_numbers() -> None:
    asked = Ask(Path("a.csv"), rate_hz=np.float32(50), tries=np.int64(3), quick=np.True_, speeds_mps=(np.float64(9),))
    assert (asked.rate_hz, asked.tries) == (50, 3)


@pytest.mark.parametrize(("words", "complaint"), [
    (["--speed", "abc"], "--speed abc: expected a number in m/s"),
    (["--speed", "10m/s"], "--speed 10m/s: expected a number in m/s, without its unit")])
def test_one_of_several_numbers_is_read_as_one_alone(words: list[str], complaint: str) -> None:
    with pytest.raises(BadInput, match=f"^{complaint}$"):
        asked("a.csv", *words)


def test_a_choice_is_a_whole_word() -> None:
    with pytest.raises(BadInput, match="iso_class AB: expected one of A, B"):
        RandomRoadQuestion(iso_class="AB")


def test_help_has_one_bracket_and_numbers_in_full() -> None:
    said = [one.help for _, one in every_option()]
    assert not [words for words in said if ") (" in words or "e+" in words]
    assert "length of a window [m] (default: 7.62, 25 ft; 1 to 1000 m)" in said
