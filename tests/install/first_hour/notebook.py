"""The cells of the notebook, from top to bottom, without Jupyter."""

import contextlib
import io
import json
import pathlib

notebook = json.loads(pathlib.Path("/root/examples/notebook.ipynb").read_text())
said = io.StringIO()
names: dict = {}
with contextlib.redirect_stdout(said):
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), names)
text = said.getvalue()
assert "(16, 576, 3)" in text
print("notebook:", text[text.index("INVALID_FIELDS"):].splitlines()[0])
