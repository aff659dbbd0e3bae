"""The assembled GLSL of a kernel as CUDA, so that NVIDIA's compiler can be asked what it costs.

The kernel becomes a struct: functions and variables of an invocation are its members, shared variables and constants
stand before it. The text goes through the C preprocessor first; GLSL's vectors and built-ins are in prelude.cuh.
"""
import os
import re
import subprocess

PRELUDE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "prelude.cuh")
SWIZZLE = re.compile(r"\.([xyzw]{2,4})\b(?!\s*\()")
FLOAT = re.compile(r"(?<![\w.])(\d+\.\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?|\d+[eE][+-]?\d+)(?![\w.])")
# Loops whose number of rounds is not a constant stay as they are, so that instructions per round can be counted.
CONSTANT_LOOP = re.compile(r"for \((?:u?int) (\w+) = \d+u?; \1 < \d+u?; (?:\+\+\1|\1 \*= 2u)\)")


def preprocessed(glsl):
    lines = [line for line in glsl.splitlines() if not re.match(r"\s*#\s*(version|extension)\b", line)]
    found = subprocess.run(["cpp", "-P", "-undef", "-nostdinc", "-"], input="\n".join(lines), capture_output=True,
                           text=True, check=True)
    return found.stdout


def closing(text, start, pair="{}"):
    """The index of the bracket that closes the one at `start`."""
    depth = 0
    for k in range(start, len(text)):
        depth += (text[k] == pair[0]) - (text[k] == pair[1])
        if depth == 0:
            return k
    raise ValueError("unbalanced " + pair + " in " + text[start:start + 200])


def declarations(text):
    """The top-level declarations and definitions, in order."""
    parts, start, k = [], 0, 0
    while k < len(text):
        if text[k] == "{":
            k = closing(text, k)
            is_block = re.match(r"\s*(struct|layout)\b", text[start:])
            if is_block:
                k = text.index(";", k)
            elif "=" in text[start:text.index("{", start)]:
                k = text.index(";", k)
            parts.append(text[start:k + 1].strip())
            start = k + 1
        elif text[k] == ";":
            parts.append(text[start:k + 1].strip())
            start = k + 1
        k += 1
    return [part for part in parts if part.strip("; \n")]


def expression(text):
    """GLSL statements as CUDA."""
    text = re.sub(r"\bprecise\s+", "", text)
    text = re.sub(r"\binout\s+(\w+)\s+(\w+)", r"\1& \2", text)
    text = SWIZZLE.sub(r".\1()", text)
    text = FLOAT.sub(r"\1f", text)
    while True:  # float[N](a, b) is {a, b}
        array = re.search(r"=\s*(\w+)\[\w+\]\(", text)
        if not array:
            break
        end = closing(text, array.end() - 1, "()")
        text = text[:array.start()] + "= {" + text[array.end():end] + "}" + text[end + 1:]
    return text


def one_loop_per_line(text):
    text = re.sub(r"(?<!\n)[ \t]*\b(for|while|do)\b(?= ?[({])", r"\n\1", text)
    text = re.sub(r"\}\s*\n(while) \(", r"} \1 (", text)  # of a do

    def marked(found):
        return found.group() if CONSTANT_LOOP.match(text, found.start(1)) else "#pragma unroll 1\n" + found.group()

    return re.sub(r"^[ \t]*(for \()", marked, text, flags=re.M)


def translate(glsl, local_size):
    """The CUDA text; its entry point is `kernel`."""
    before, members, buffers = [], [], []
    for part in declarations(preprocessed(glsl)):
        block = re.match(r"layout\(std430[^)]*\)([\w\s]*)\bbuffer \w+ \{\s*(\w+) (\w+)\[\];\s*\};", part)
        if block:
            const = "const " if "readonly" in block.group(1) else ""
            buffers.append((f"{const}{block.group(2)}* __restrict__", block.group(3)))
        elif re.match(r"layout\([^)]*\) in;", part):
            continue
        elif re.match(r"layout\([^)]*\)\s*uniform", part):
            kind, name = re.match(r"layout\([^)]*\)\s*uniform (\w+) (\w+);", part).groups()
            buffers.append((kind, name))
        elif part.startswith("struct"):
            before.append(expression(part))
        elif part.startswith("const "):
            before.append("constexpr " + expression(part)[len("const "):])
        elif part.startswith("shared "):
            before.append("__shared__ " + expression(part)[len("shared "):])
        elif part.endswith("}"):
            members.append("GLSL " + one_loop_per_line(re.sub(r"\bmain\(\)", "Main()", expression(part))))
        else:
            members.append(expression(part))
    with open(PRELUDE, encoding="utf-8") as file:
        prelude = file.read()
    fields = "\n".join(f"{kind} {name};" for kind, name in buffers)
    arguments = ", ".join(f"{kind} {name}_" for kind, name in buffers)
    copies = "\n".join(f"shader.{name} = {name}_;" for _, name in buffers)
    return (f"#define LOCAL_SIZE {local_size}\n{prelude}\n" + "\n".join(before) +
            f"\nstruct Shader {{\n{fields}\n" + "\n".join(members) + "\n};\n" +
            f'extern "C" __global__ void __launch_bounds__({local_size}) kernel({arguments}) {{\n' +
            f"Shader shader;\n{copies}\nshader.Main();\n}}\n")
