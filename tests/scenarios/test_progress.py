"""What a command says while it works, where standard error is no terminal."""

from scenarios.cli.progress import lines


def told(capsys, *steps):
    """Return the lines printed for steps of (time, done) of 100."""
    now = [0.0]
    say = lines("ticks", clock=lambda: now[0])
    for t, done in steps:
        now[0] = t
        say("tpm", done, 100)
    return capsys.readouterr().err.splitlines()


def test_a_short_command_is_silent(capsys):
    assert told(capsys, (0.0, 0), (5.0, 50), (9.0, 100)) == []


def test_a_long_one_says_every_ten_seconds_how_far_it_is_and_what_is_left(capsys):
    said = told(capsys, (0.0, 0), (6.0, 10), (12.0, 20), (18.0, 30), (24.0, 40), (60.0, 100))
    assert said == ["tpm: 20 of 100 ticks, about 48 s left",
                    "tpm: 40 of 100 ticks, about 36 s left"]
