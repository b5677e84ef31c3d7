from hypothesis import given
from hypothesis import strategies as st

from goalreach_dashboard.views.svg import View, difference

_names = st.sampled_from(['a', 'b', 'c'])
_keys = st.sampled_from(['text', 'html', 'points', 'x'])
_texts = st.text('ab ', max_size=60)
_views = st.dictionaries(_names, st.dictionaries(_keys, _texts, max_size=3), max_size=3)


def shown_after(shown: View, patch: View) -> dict[str, dict[str, str]]:
    """Do what live.js does."""
    page = {name: dict(attributes) for name, attributes in shown.items()}
    for name, changes in patch.items():
        element = page.setdefault(name, {})
        for key, value in changes.items():
            if key.startswith('+'):
                element[key[1:]] = element.get(key[1:], '') + value
            else:
                element[key] = value
    return page


@given(_views, _views, st.booleans())
def test_a_patched_page_shows_the_new_view(old: View, new: View, grows: bool) -> None:  # noqa: FBT001
    if grows:
        new = {n: {k: v * 2 for k, v in e.items()} for n, e in old.items()}
    page = shown_after(old, difference(new, old))
    for name, attributes in new.items():
        for key, value in attributes.items():
            assert page[name][key] == value


def test_only_what_changed_is_sent() -> None:
    old = {'a': {'x': '1', 'y': '2'}, 'b': {'text': 'same'}}
    new = {'a': {'x': '1', 'y': '3'}, 'b': {'text': 'same'}}
    assert difference(new, old) == {'a': {'y': '3'}}


def test_a_trail_that_grows_is_appended_to() -> None:
    before = '1.0,2.0 ' * 10
    patch = difference({'trail': {'points': before + '3.0,4.0 '}}, {'trail': {'points': before}})
    assert patch == {'trail': {'+points': '3.0,4.0 '}}
