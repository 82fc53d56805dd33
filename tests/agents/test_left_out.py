"""What would have come and cannot be performed is said with the reason."""

from types import SimpleNamespace

from mplearn_agents.commands.perform import _left_out


def test_what_follows_and_cannot_be_performed_is_named_once_with_its_first_reason():
    names = {1: "step", 2: "leap", 4: "sit"}
    refused = {1: {3: ("too far", "too fast")}, 2: {}, 4: {3: ("too far",), 0: ("hold",)}}
    repertoire = SimpleNamespace(
        after=lambda id: SimpleNamespace(refused=refused[id]),
        primitive={0: None, 3: 2}.get,
        library={id: SimpleNamespace(name=name) for id, name in names.items()},
    )
    for performed, said in (((1, 4, 1), [("leap", "too far")]), ((2,), []), ((), [])):
        result = SimpleNamespace(primitives=performed)
        assert _left_out(repertoire, result) == said
