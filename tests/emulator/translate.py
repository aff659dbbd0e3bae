"""The assembled GLSL of a kernel as C++, for the emulator: `translate.py KERNEL.glsl ORIGINS > KERNEL.cpp`.

ORIGINS has the file and line of each line of the kernel, which become #line directives. Functions and variables of an
invocation are members of a struct; words of storage blocks and of shared memory are of types that report each access
(glsl.h). LOCAL_SIZE is a number that the emulator chooses when it runs the kernel.
"""
import os
import re
import subprocess
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "bench", "kernels"))
sys.dont_write_bytecode = True
import translate as cuda  # noqa: E402

VALUE = r"float|uint|int|bool|[iu]?vec[234]|mat3"
MEMORY_TYPES = {"float": "Word<Float>", "uint": "Word<uint>", "int": "Word<int>", "vec2": "WordVec2",
                "vec3": "WordVec3", "vec4": "WordVec4"}


def preprocessed(glsl):
    """The text without directives, and the number of each of its lines in `glsl`."""
    kept = ["" if re.match(r"\s*#\s*(version|extension|define LOCAL_SIZE)\b", line) else line
            for line in glsl.splitlines()]
    found = subprocess.run(["cpp", "-undef", "-nostdinc", "-"], input="\n".join(kept), capture_output=True, text=True,
                           check=True)
    lines, numbers, number, is_own = [], [], 1, True
    for line in found.stdout.splitlines():
        marker = re.match(r'# (\d+) "(.*)"', line)
        if marker:
            number, is_own = int(marker.group(1)), marker.group(2) == "<stdin>"
        else:
            if is_own:
                lines.append(line)
                numbers.append(number)
            number += 1
    return "\n".join(lines), numbers


def located_declarations(text):
    """Each top-level declaration with the index of its first line."""
    start = 0
    for part in cuda.declarations(text):
        start = text.index(part, start)
        yield part, text.count("\n", 0, start)
        start += len(part)


def expression(text):
    text = re.sub(r"\binout\s+(\w+)\s+(\w+)", r"\1& \2", text)
    text = re.sub(r"\bprecise\s+", "", text)
    text = cuda.SWIZZLE.sub(r".\1()", text)
    text = cuda.FLOAT.sub(r"\1_f", text)
    text = re.sub(rf"\b({VALUE}|[A-Z]\w+) (\w+)\[([^\]]+)\](?=[;,)]| =)", r"Array<\1, \3> \2", text)
    while True:  # float[N](a, b) is {a, b}
        array = re.search(r"=\s*(\w+)\[\w+\]\(", text)
        if not array:
            return text
        end = cuda.closing(text, array.end() - 1, "()")
        text = text[:array.start()] + "= {" + text[array.end():end] + "}" + text[end + 1:]


def fields(struct):
    """Type, name and count of each member; no count for what is no array."""
    body = struct[struct.index("{") + 1:struct.rindex("}")]
    found = []
    for line in body.split(";")[:-1]:
        kind, names = line.split(None, 1)
        for name in names.split(","):
            found.append((kind, *re.match(r"\s*(\w+)\s*(?:\[(.*)\])?\s*$", name, re.S).groups()))
    return found


def value_struct(name, struct):
    members = "".join(f"{f'Array<{kind}, {count}>' if count else kind} {field};\n"
                      for kind, field, count in fields(struct))
    return f"struct {name} {{\n{members}}};"


def memory_struct(name, struct):
    """The same struct in memory, where words report accesses."""
    members = "".join(f"{f'Array<{memory_type(kind)}, {count}>' if count else memory_type(kind)} {field};\n"
                      for kind, field, count in fields(struct))
    names = [field for _, field, _ in fields(struct)]
    loads = ", ".join(names)
    stores = "".join(f"{field} = value.{field};\n" for field in names)
    return (f"struct InMemory{name} {{\n{members}GLSL operator {name}() const {{ return {{{loads}}}; }}\n"
            f"GLSL InMemory{name}& operator=(const {name}& value) {{\n{stores}return *this;\n}}\n}};")


def memory_type(kind):
    return MEMORY_TYPES.get(kind, "InMemory" + kind)


class Translation:
    def __init__(self, glsl, origins):
        text, self.numbers = preprocessed(glsl)
        self.origins = origins
        self.parts = list(located_declarations(text))
        self.structs = {re.match(r"struct (\w+)", part).group(1): part for part, _ in self.parts
                        if part.startswith("struct")}
        self.in_memory = set()
        self.before, self.members, self.references = [], [], []
        self.blocks, self.shared, self.uniforms = [], [], []

    def mark_in_memory(self, kind):
        if kind in self.structs and kind not in self.in_memory:
            self.in_memory.add(kind)
            for inner, _, _ in fields(self.structs[kind]):
                self.mark_in_memory(inner)

    def with_lines(self, text, first):
        result = []
        for offset, line in enumerate(text.split("\n")):
            number = self.numbers[min(first + offset, len(self.numbers) - 1)]
            if number <= len(self.origins):
                file, origin = self.origins[number - 1]
                result.append(f'#line {origin} "{file}"')
            result.append(line)
        return "\n".join(result)

    def find_memory(self):
        for part, _ in self.parts:
            block = re.match(r"layout\(std430[^{]*buffer \w+ \{\s*(\w+) \w+\[\];", part)
            shared = re.match(r"shared (\w+) ", part)
            if block or shared:
                self.mark_in_memory((block or shared).group(1))

    def add_block(self, part):
        binding, words, kind, name = re.match(
            r"layout\(std430, binding = (\d+)\)([\w\s]*)\bbuffer \w+ \{\s*(\w+) (\w+)\[\];\s*\};", part).groups()
        kind = memory_type(kind)
        self.before.append(f"static Block<{kind}> {name};")
        self.blocks.append(f'{{{binding}, "{name}", {int("coherent" in words.split())}, '
                           f'{int("readonly" in words.split())}, sizeof({kind}), &{name}}}')

    def add_shared(self, part):
        kind, name, size = re.match(r"shared (\w+) (\w+)(?:\[(.*)\])?;", part, re.S).groups()
        kind = memory_type(kind)
        own = name if size else name + "_"
        self.before.append(f"static Block<{kind}> {own};")
        self.shared.append(f'shared.push_back({{0, "{name}", 1, 0, sizeof({kind}), &{own}, '
                           f'uint({expression(size or "1")})}});')
        if not size:
            self.references.append(f"{kind}& {name} = {own}[0];")

    def add_constant(self, part, line):
        name, value = re.match(r"const \w+ (\w+)(?:\[\w+\])? = (.*);", part, re.S).groups()
        varies = ["LOCAL_SIZE"] + [macro.split()[1] for macro in self.before if macro.startswith("#define")]
        if any(re.search(rf"\b{word}\b", value) for word in varies):
            self.before.append(f"#define {name} (uint({' '.join(expression(value).split())}))")
        else:
            self.before.append(self.with_lines("static " + expression(part), line))

    def add(self, part, line):
        if part.startswith("layout(std430"):
            self.add_block(part)
        elif re.match(r"layout\([^)]*\) in;", part):
            return
        elif part.startswith("layout"):
            location, kind, name = re.match(r"layout\(location = (\d+)\)\s*uniform (\w+) (\w+);", part).groups()
            self.before.append(f"static {kind} {name};")
            self.uniforms.append(f"{{{location}, &{name}}}")
        elif part.startswith("struct"):
            name = re.match(r"struct (\w+)", part).group(1)
            self.before.append(value_struct(name, part))
            if name in self.in_memory:
                self.before.append(memory_struct(name, part))
        elif part.startswith("const "):
            self.add_constant(part, line)
        elif part.startswith("shared "):
            self.add_shared(part)
        elif part.endswith("}"):
            self.members.append(self.with_lines(re.sub(r"\bmain\(\)", "Main()", expression(part)), line))
        else:
            self.members.append(expression(part))

    def text(self):
        self.find_memory()
        for part, line in self.parts:
            self.add(part, line)
        join = "\n".join
        return ('#include "glsl.h"\n#define float Float\n' + join(self.before) +
                "\nstruct Shader : Invocation {\nusing Invocation::Invocation;\n" + join(self.references) + "\n" +
                join(self.members) + '\n};\n#line 1 "kernel"\nvoid RunInvocation(const Ids& ids) {\n' +
                "Shader shader(ids);\nshader.Main();\n}\n" +
                "void Describe(std::vector<BlockInfo>& blocks, std::vector<BlockInfo>& shared,\n"
                "              std::vector<UniformInfo>& uniforms) {\n"
                "blocks = {" + ", ".join(self.blocks) + "};\nuniforms = {" + ", ".join(self.uniforms) + "};\n" +
                join(self.shared) + "\n}\n")


def main():
    glsl_path, origins_path = sys.argv[1:]
    with open(glsl_path, encoding="utf-8") as file:
        glsl = file.read()
    with open(origins_path, encoding="utf-8") as file:
        origins = [line.rsplit(":", 1) for line in file.read().splitlines()]
    sys.stdout.write(Translation(glsl, origins).text())


if __name__ == "__main__":
    main()
