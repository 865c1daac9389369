"""Words of Tables 2.3 and 2.4."""

import pytest

from logger.roads import sections
from logger.roads.sections import RIDES, ride_words, road_kinds


@pytest.mark.parametrize(("iri_m_per_km", "kinds"), [
    (0.2, ()),
    (0.25, ("airport runways and superhighways",)),
    (1.6, ("airport runways and superhighways", "new pavements")),
    (3.25, ("new pavements", "older pavements", "maintained unpaved roads")),
    (9.0, ("maintained unpaved roads", "damaged pavements", "rough unpaved roads")),
    (20.0, ("rough unpaved roads",)),
    (20.1, ()),
])
def test_a_value_has_every_kind_of_road_whose_range_holds_it(iri_m_per_km: float, kinds: tuple[str, ...]) -> None:
    assert road_kinds(iri_m_per_km) == kinds


def test_a_ride_holds_up_to_the_next_mark() -> None:
    marks = [0.0, 4.0, 6.0, 8.0, 10.0]
    assert [ride_words(mark) for mark in marks] == [words for _, words in RIDES]
    assert [ride_words(mark - 0.001) for mark in marks[1:]] == [words for _, words in RIDES[:-1]]
    assert ride_words(50.0) == RIDES[-1][1]
    for wrong in (-0.1, float("nan")):
        with pytest.raises(ValueError, match="0 or more"):
            ride_words(wrong)


def test_the_ranges_are_those_of_table_2_3() -> None:
    bounds = [(lowest, highest) for lowest, highest, _ in sections.ROAD_RANGES]
    assert bounds == [(0.25, 1.75), (1.5, 3.25), (2.25, 5.75), (3.25, 10.0), (4.0, 10.75), (8.0, 20.0)]
