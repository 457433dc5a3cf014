from pathlib import Path

SYSTEMD = Path(__file__).parents[2] / "systemd"


def directives(unit: str) -> list[str]:
    lines = (SYSTEMD / unit).read_text().splitlines()
    return [line for line in lines if line and not line.startswith("#")]


def test_one_of_several_tables_is_as_safe_as_a_single_one_and_differs_in_its_names_alone() -> None:
    single, instance = directives("touchd.service"), directives("touchd@.service")
    differing = [(one, other) for one, other in zip(single, instance, strict=True) if one != other]
    assert differing == [
        (
            "Description=touchd, multi-touch from a depth camera",
            "Description=touchd, multi-touch from a depth camera (%i)",
        ),
        (
            "ExecStart=/opt/touchd/venv/bin/touchd run --config /etc/touchd/touchd.yaml",
            "ExecStart=/opt/touchd/venv/bin/touchd run --config /etc/touchd/%i.yaml",
        ),
        (
            "ExecStopPost=-/opt/touchd/venv/bin/touchd lift --config /etc/touchd/touchd.yaml",
            "ExecStopPost=-/opt/touchd/venv/bin/touchd lift --config /etc/touchd/%i.yaml",
        ),
        ("StateDirectory=touchd", "StateDirectory=touchd/%i"),
        ("RuntimeDirectory=touchd", "RuntimeDirectory=touchd-%i"),
    ]


def test_the_camera_rule_comes_before_the_one_that_acts_on_its_tag() -> None:
    (rule,) = SYSTEMD.glob("*.rules")
    assert 'TAG+="uaccess"' in rule.read_text()
    assert rule.name < "73-seat-late.rules"
