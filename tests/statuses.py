"""Statuses of daemons that fare well and badly."""

from touchd.align.alignment import AreaOrigin
from touchd.model import State
from touchd.outputs.output import OutputStatus
from touchd.outputs.udp import DestinationStatus
from touchd.status.data import (
    AreaFacts,
    ConfigFacts,
    OutputFacts,
    SourceFacts,
    Status,
    SurfaceFacts,
    output_facts,
)

NOW_S = 1_700_000_000.0
SOURCE = SourceFacts("A00364A04287049A", "kinect", None, 1, 241201, 29.97, 12, 0, 1.42, 3.1, 4.04)
SURFACE = SurfaceFacts(NOW_S - 7300, "A00364A04287049A", 0.998, 0.42, 4.4, 16.2, 1.1, 3.2, 821.4, 0.0, ())
TUIO = OutputFacts("tuio to 127.0.0.1:3333", 20314, 0, 0, 0, None)
HEALTHY = Status(
    version="0.1.0",
    pid=812,
    time_s=NOW_S,
    started_s=NOW_S - 8100,
    memory_bytes=86_400_000,
    state=State.TRACKING,
    state_since_s=NOW_S - 8040,
    why=None,
    cursors=2,
    touches=1204,
    config=ConfigFacts("/etc/touchd/touchd.yaml"),
    not_kept=None,
    source=SOURCE,
    surface=SURFACE,
    area=AreaFacts(AreaOrigin.ALIGNMENT, (800.4, 599.6), 1.4),
    outputs=(TUIO,),
)
FAILING = output_facts(
    OutputStatus("tuio to a:3333, b:3333", 100, 7, 0, "Cannot send to b:3333: Network is unreachable."),
    (
        DestinationStatus("a:3333", 100, 0, None, "10.0.0.1"),
        DestinationStatus("b:3333", 0, 7, "Cannot send to b:3333: Network is unreachable.", None),
    ),
    troubled_lately=7,
)
REFUSED = ConfigFacts("/etc/touchd/touchd.yaml", "touchd.yaml:1:2: tracking is wrong\n  here\n  ^", NOW_S - 185)
