"""What a stand cannot guard in a campaign, in words, and the consent that a missing temperature stop needs.

One place: plan, start, run file and report show these sentences, and nothing else says the like.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator

from bufferstand.daq.guards.wiring import little_expected
from bufferstand.drivers.register_maps import Profile
from bufferstand.drivers.stand_file import StandFile, power_on_C
from bufferstand.foundation import DELAYS_TO_SPEED, NO_TEMPERATURE_STOP, BadInput
from bufferstand.foundation.settings import place_of, read_text
from bufferstand.foundation.specimen import Specimen
from bufferstand.protocols.campaign_file import Campaign, GuardTable, WatchedSensors
from bufferstand.protocols.planning import Plan
from bufferstand.protocols.prediction import Predictor
from bufferstand.protocols.steps import PlannedStep, WaitUntilCool

HARMED_BY_HEAT = ("elastomer", "rubber-steel", None)
"""Elastic systems that heat destroys; one that nobody has stated counts as such."""
ONLY_NOTED = (
    ("heating", "a specimen that heats too fast"),
    ("frozen", "a frozen channel"),
    ("wiring", "a sensor whose sign, scale, zero or delay is wrong, or that has come off,"),
)
"""Guards that stop unless ``[guards.action]`` makes them a note, and what they see."""
CONSENT = "no_temperature_stop"
"""Key of ``[limits]`` that states why a campaign may do without the temperature stop."""
REASON_WORDS, REASON_LETTERS = 3, 10
"""A reason has at least so many different words, and so many letters: “TODO” and “.” are none."""


def thermometers_on_specimen(stand_file: StandFile) -> tuple[str, ...]:
    """Return the names of the thermometers that stop a campaign."""
    return tuple(one.name for one in stand_file.temperature_sensors if one.role == "specimen")


def watching_of(stand_file: StandFile) -> WatchedSensors:
    """Return what the planner must know of a stand's sensors."""
    slowest_s = max((one.settings.period_s for one in stand_file.thermometers), default=None)
    return WatchedSensors(power_on_C(stand_file), slowest_s)


def unguarded(plan: Plan, stand_file: StandFile, predictor: Predictor | None = None) -> tuple[str, ...]:
    """Return what is not guarded in a campaign on a stand, one sentence each, most dangerous first.

    Parameters
    ----------
    plan : Plan
    stand_file : StandFile
    predictor : Predictor, optional
        What is known of the specimen.
    """
    table = plan.campaign.content.guards
    return (
        *_heat(stand_file, plan),
        *_force_and_stroke(stand_file, plan),
        *filter(None, [little_expected(plan, predictor)]),
        *_only_noted(table),
        *_controller(stand_file.profile()),
    )


UNGUARDED_AT_SPEED = "a delay of force or force_2, and which of them jumps in motion"
"""What is not guarded at a speed at which no stand moves; it says nothing about the stand."""


def unguarded_at(speed: float, stand_file: StandFile) -> tuple[str, ...]:
    """Return what is not guarded besides on a simulated stand that is so many times as fast as the wall."""
    if not stand_file.amplifier or speed <= DELAYS_TO_SPEED:
        return ()
    text = (
        f"{UNGUARDED_AT_SPEED}: at {speed:g} times real time the "
        "samples of both are not stamped closely enough; rehearse at "
        f"--speed {DELAYS_TO_SPEED:g} or less to see them"
    )
    return (text,)


def what_is_unguarded(sentences: Collection[str]) -> tuple[str, ...]:
    """Return what each sentence of :func:`unguarded` says is missing, without names, figures and reasons.

    By these two plans are compared with each other.
    """
    return tuple(text.partition(":")[0].partition(" (")[0] for text in sentences)


def demand_consent(campaign: Campaign, specimen: Specimen, stand_file: StandFile) -> None:
    """Refuse a specimen that heat destroys on a stand that does not see it, unless somebody has said why.

    Raises
    ------
    BadInput
        With what to do.
    """
    stated = _stated(campaign)
    path = ("limits", CONSENT)
    if thermometers_on_specimen(stand_file):
        if stated:
            raise BadInput(
                f"{CONSENT} is stated, and stand “{stand_file.stand.id}” has a thermometer on the specimen: "
                "this campaign has a temperature stop",
                file=campaign.path,
                place=place_of(path, read_text(campaign.path)),
                remedy="leave the key out",
            )
        return
    if stated and not is_reason(stated):
        raise BadInput(
            f"{CONSENT} = {campaign.limits.no_temperature_stop!r} gives no reason: one has at least "
            f"{REASON_WORDS} words and {REASON_LETTERS} letters",
            file=campaign.path,
            place=place_of(path, read_text(campaign.path)),
            remedy="write why heat cannot harm this specimen here, such as “two slow strokes of a cold "
            "spring”; the report shows it",
        )
    if stated or specimen.elastic_system not in HARMED_BY_HEAT:
        return
    system = specimen.elastic_system
    what = f"an elastic system of {system}" if system else "an elastic system that its file does not state"
    raise BadInput(
        f"{NO_TEMPERATURE_STOP}: stand “{stand_file.stand.id}” has no thermometer on the "
        f"specimen, and “{specimen.id}” has {what}, which heat destroys",
        file=campaign.path,
        place=place_of(("limits",), read_text(campaign.path)),
        remedy=f"put a thermometer on it ([[temperature.sensor]] with role = “specimen” in the stand file), "
        f'or state why it may do without: {CONSENT} = "reason" (at least {REASON_WORDS} words) under [limits]'
        + ("" if system else "; or state elastic_system in the specimen file, if it is a ring spring"),
    )


def is_reason(text: str) -> bool:
    """Return whether a text can be a reason: words enough, letters enough, and not one of them repeated.

    What shows nothing (blanks, characters of no width) is no letter, and neither are signs and figures.
    """
    words = [word for part in text.split() if (word := "".join(filter(str.isalpha, part)))]
    return (
        len({word.casefold() for word in words}) >= REASON_WORDS
        and sum(map(len, words)) >= REASON_LETTERS
        and len({letter for word in words for letter in word.casefold()}) >= REASON_LETTERS // 2
    )


def demand_thermometers(plan: Plan, stand_file: StandFile, over: Collection[str] = ()) -> None:
    """Refuse a step that goes by the specimen's temperature on a stand that has no thermometer on it.

    A wait that nobody can see the end of would end at once, and a band in which a step begins would hold
    whatever the specimen is like.

    Parameters
    ----------
    plan : Plan
        With all of its steps.
    stand_file : StandFile
        Its thermometers.
    over : collection of str
        Plan hashes of steps that are complete: they are not refused any more.

    Raises
    ------
    BadInput
        With the step, what it needs the thermometer for, and what to do.
    """
    if thermometers_on_specimen(stand_file):
        return
    for step in plan.steps:
        what = _goes_by_temperature(step)
        if not what or step.plan_hash in over:
            continue
        raise BadInput(
            f"step {step.index} “{step.name}” {what}, and stand “{stand_file.stand.id}” has no thermometer "
            "on the specimen: nobody would see its temperature",
            file=plan.campaign.path,
            place=step.place,
            remedy="put one on it ([[temperature.sensor]], role = “specimen”, in the stand file), or leave "
            + _what_to_leave(step),
        )


def _goes_by_temperature(step: PlannedStep) -> str:
    """Return what a step needs the specimen's temperature for; empty if it needs none."""
    if step.start_band is not None:
        return f"begins at {step.start_band.text()} °C"
    if step.warmth is not None:
        return f"ends when the specimen is at {step.warmth.temperature_C:g} °C"
    for motion in step.motions:
        if isinstance(motion, WaitUntilCool):
            return f"waits until the specimen is at {motion.temperature_C:g} °C or below"
    return ""


def _what_to_leave(step: PlannedStep) -> str:
    if step.start_band is not None:
        return "start_temperature_C out"
    if step.pause:
        return "order = “soonest” under [plan] out: it waits for the specimen to cool"
    instead = "; a wait by the clock is a step kind = “hold” with duration_s and neither stroke nor force"
    return "the step out" + (instead if step.only_waits else "")


def _stated(campaign: Campaign) -> str:
    """Return what stands in the consent, without what shows nothing."""
    text = campaign.limits.no_temperature_stop
    return "".join(sign if sign.isprintable() else " " for sign in text).strip()


def _heat(stand_file: StandFile, plan: Plan) -> Iterator[str]:
    names = thermometers_on_specimen(stand_file)
    if not names:
        reason = _stated(plan.campaign)
        stated = f"; stated reason: {reason}" if reason else ""
        yield f"{NO_TEMPERATURE_STOP}: no thermometer on the specimen{stated}"
    elif len(names) == 1:
        yield f"one thermometer on the specimen ({names[0]}): if it reads too low, no other sees the heat"


def _force_and_stroke(stand_file: StandFile, plan: Plan) -> Iterator[str]:
    names = [channel.name for channel in stand_file.controller.channel]
    beside = [channel.name for device in stand_file.acquisition for channel in device.channels]
    if not stand_file.amplifier and "force_2" not in (*names, *beside):
        yield "no second force: a load cell or scale that is wrong is not seen by another"
    if "stroke_2" not in names or one_wire(stand_file.profile()):
        yield "one draw wire: tilt is not watched"
    if plan.specimen.max_stroke_mm is None and plan.campaign.limits.stroke_max_mm is None:
        yield (
            "the specimen's own stroke is not stated: the stroke guard knows the "
            f"{plan.limits.stroke.value:g} mm of {plan.limits.stroke.source} only"
        )


def one_wire(profile: Profile) -> bool:
    """Return whether both draw wires of a controller are read from the same register."""
    if not (profile.has("raw_stroke_1") and profile.has("raw_stroke_2")):
        return False
    one, two = profile.find("raw_stroke_1"), profile.find("raw_stroke_2")
    return (one.table, one.address) == (two.table, two.address)


def _only_noted(table: GuardTable) -> Iterator[str]:
    for name, what in ONLY_NOTED:
        if getattr(table.action, name) == "note":
            yield f"{what} is only noted ([guards.action] {name} = “note”)"


def _controller(profile: Profile) -> Iterator[str]:
    if not profile.has("writer"):
        yield "no controller lock: another program may command the controller meanwhile"
    if profile.window is None:
        yield (
            "no sample ring: the guards see what is polled, with this computer's clock; "
            "what lies between two polls, and cycles that the controller misses, are not seen"
        )
