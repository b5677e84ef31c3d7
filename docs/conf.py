"""Sphinx configuration of the documentation site; `python3 scripts/docs.py` builds it."""

project = 'goalreach'
html_title = 'goalreach'
language = 'en'
extensions = ['myst_parser', 'sphinx.ext.autodoc', 'sphinx.ext.napoleon']
myst_enable_extensions = ['deflist']
myst_heading_anchors = 4
default_role = 'code'
highlight_language = 'text'
smartquotes_action = 'D'  # dashes only
python_maximum_signature_line_length = 80

autodoc_class_signature = 'mixed'
autodoc_member_order = 'bysource'
autodoc_preserve_defaults = True
autodoc_typehints = 'signature'
napoleon_use_ivar = True
napoleon_use_rtype = False
python_use_unqualified_type_names = True
add_module_names = False
toc_object_entries_show_parents = 'hide'

html_theme = 'furo'
html_logo = html_favicon = 'assets/icon.svg'
html_static_path = ['assets']
html_css_files = ['site.css']
html_use_index = html_domain_indices = False
html_copy_source = html_show_sourcelink = html_show_copyright = html_show_sphinx = False
html_theme_options = {
    'light_css_variables': {'color-brand-primary': '#00598c', 'color-brand-content': '#00598c'},
    'dark_css_variables': {'color-brand-primary': '#7cc4f2', 'color-brand-content': '#7cc4f2'},
    'top_of_page_buttons': [],
}
pygments_style = 'default'
pygments_dark_style = 'monokai'
