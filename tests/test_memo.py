import pickle

from railui.memo import IdentityCache


def test_the_least_recently_used_value_is_discarded_first():
    cache = IdentityCache[str](max_size=2)
    for key in ("a", "b", "a", "c"):
        cache.get(key, lambda key=key: key.upper())
    assert len(cache) == 2
    assert cache.get("a", lambda: "new") == "A"
    assert cache.get("b", lambda: "new") == "new"


def test_owners_are_compared_by_identity_not_by_equality():
    cache = IdentityCache[int](max_size=4)
    first, second = [1], [1]
    assert cache.get("key", lambda: 1, owner=first) == 1
    assert cache.get("key", lambda: 2, owner=second) == 2
    assert cache.get("key", lambda: 3, owner=first) == 1


def test_an_owner_lives_as_long_as_its_value():
    cache = IdentityCache[int](max_size=4)
    for number in range(4):  # no two of these lists exist at once unless the cache keeps them
        assert cache.get("key", lambda number=number: number, owner=[]) == number


def test_a_pickled_cache_keeps_its_size_and_no_values():
    cache = IdentityCache[int](max_size=3)
    cache.get("key", lambda: 1)
    copy = pickle.loads(pickle.dumps(cache))
    assert copy.max_size == 3 and len(copy) == 0
