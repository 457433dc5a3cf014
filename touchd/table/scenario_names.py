"""The scenarios' names, for those who must not wait for numpy."""

DEFAULT_SCENARIO = "mixed"

# Name and meaning, in the order in which they are listed for people; "mixed" plays all others in this order.
SCENARIOS = {
    "taps": "one finger taps here and there",
    "drag": "one finger draws lines",
    "pinch": "thumb and index finger draw apart, together, and turn",
    "hover": "a finger stays above the table and never touches",
    "circles": "one finger draws circles",
    "two-hands": "two fingers, one of each hand, draw apart and together",
    "ten": "all ten fingers slide and turn",
    "mixed": "a minute of all of these",
}
