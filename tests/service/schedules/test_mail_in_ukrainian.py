"""Mails of schedules in the language that the service is set to; webhooks are English."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from datetime import UTC, datetime

import pytest
from pydantic import ValidationError

from sprag_study.sentences import Amount, Clause, Sentence
from sprag_study.service import languages
from sprag_study.service.answers import filled
from sprag_study.service.answers.schedules import RunOutcome
from sprag_study.service.delivery import Delivery, DeliverySettings
from sprag_study.service.jobs.reports.message import mail, sentence, webhook_body
from sprag_study.service.languages import recorded
from sprag_study.service.schedules.outcomes import Outcome, Result
from sprag_study.service.storage.schedules.reports import Claimed
from sprag_study.worker.order import Coverage

NIGHT = datetime(2026, 11, 23, 1, tzinfo=UTC)
OUTCOME = Outcome(Result.FINISHED, "st_1", "Feeder", 12_000, 12_000, 11_970, {"chatter": 3}, ended_at=NIGHT)


def report(outcome: Outcome) -> Claimed:
    content = {
        "schedule": "sc_1", "name": "Живильник", "due": NIGHT.isoformat(), "zone": "UTC", "study": outcome.study,
        "outcome": filled(RunOutcome, outcome, ended_at=NIGHT.isoformat()),
        "known": {"reason": outcome.reason, "missed": outcome.missed, **outcome.sentences},
    }  # fmt: skip
    return Claimed(1, "rp_1", "sc_1", "email", "dora@example.com", content, 1, NIGHT, NIGHT)


def test_a_mail_is_in_the_language_of_the_service() -> None:
    made = mail(report(OUTCOME), Delivery(sender="sprag@example.com", language="uk"), NIGHT, None)
    assert made["Subject"] == "Sprag: потрібна увага: Живильник: завершене, 11\u202f970 з 12\u202f000 випадків ok"
    text, page = (made.get_body((kind,)) for kind in ("plain", "html"))
    assert text is not None
    assert page is not None
    lines = text.get_content().splitlines()
    assert lines[0] == "Закінчено: готово 12\u202f000 з 12\u202f000 випадків, з них 11\u202f970 завершилися успішно."
    assert "Завершення «деренчання»: 3 випадки" in lines
    assert OUTCOME.sentence not in text.get_content()
    assert '<html lang="uk">' in page.get_content()
    assert ">Дослідження</a>" in page.get_content()
    assert languages.current() == languages.ENGLISH


def test_a_mail_says_reasons_and_coverage_in_the_language_of_the_service() -> None:
    coverage = str(Coverage(1, 3, 4, (2, 2)))
    outcome = Outcome(Result.DEADLINE, "st_1", "Feeder", 9, 5, 5, coverage=coverage, ended_at=NIGHT)
    refused = Outcome(Result.REFUSED, reason=recorded.NOT_IN_TIME)
    delivery = Delivery(sender="sprag@example.com", language="uk")
    bodies = [mail(report(each), delivery, NIGHT, None).get_body(("plain",)) for each in (outcome, refused)]
    late, never = (body.get_content() for body in bodies if body is not None)
    assert "Покриття: прохід 1 з 3 завершено, сітка з 2 x 2 значень" in late.splitlines()
    assert "Жоден обчислювач не працював, доки не минув кінцевий строк" in never


def test_a_mail_says_sentences_with_their_values() -> None:
    coverage = Coverage(1, 3, 41, ()).sentence
    outcome = Outcome(Result.DEADLINE, "st_1", "Feeder", 99, 50, 50, coverage=coverage, ended_at=NIGHT)
    room = Sentence(recorded.NO_ROOM_FOR_RESULTS, size=Amount(1.25, "GB", 3), room=Amount(3.5, "MB", 3))
    refused = Outcome(Result.REFUSED, reason=room)
    delivery = Delivery(sender="sprag@example.com", language="uk")
    bodies = [mail(stored(report(each)), delivery, NIGHT, None).get_body(("plain",)) for each in (outcome, refused)]
    late, never = (body.get_content() for body in bodies if body is not None)
    assert "Покриття: прохід 1 з 3 завершено, 41 випадок" in late.splitlines()
    assert "1,25 ГБ" in never
    assert "3,5 МБ" in never
    assert not re.search("[A-Za-z]{4,}", never.splitlines()[0])


def test_an_alarm_says_its_sentence_with_its_values() -> None:
    why = Sentence(recorded.WAITS, problem=Clause(Coverage(0, 4, 0, ()).sentence))
    alarm = Sentence(recorded.NOTHING_RAN, due="06:00", why=why)
    content = {"sentence": alarm, "known": {"sentence_values": alarm.to_json()}}
    with languages.language("uk"):
        assert sentence(content).endswith("жодного проходу з 4 ще не завершено.")
        assert sentence({"sentence": str(alarm)}) == sentence(content)  # as earlier versions stored it
    assert sentence(content) == str(alarm)


def stored(told: Claimed) -> Claimed:
    """A report that was in the database."""
    return replace(told, content=json.loads(json.dumps(told.content)))


def test_mails_are_english_unless_they_are_set_otherwise_and_webhooks_always() -> None:
    english = mail(report(OUTCOME), Delivery(sender="sprag@example.com"), NIGHT, None)
    assert english["Subject"] == "Sprag: needs attention: Живильник: finished, 11\u202f970 of 12\u202f000 cases ok"
    bodies = [webhook_body(report(OUTCOME), Delivery(language=code)) for code in ("en", "uk")]
    assert bodies[0] == bodies[1]


def test_the_setting_takes_known_languages_only() -> None:
    assert DeliverySettings(mail_language="uk").delivery("http://127.0.0.1").language == "uk"
    with pytest.raises(ValidationError, match="allowed: en, uk"):
        DeliverySettings(mail_language="tlh")
