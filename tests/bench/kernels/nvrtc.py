"""NVIDIA's run-time compiler and its disassembler, from the packages that `./run bench kernels` installs. No GPU."""
import ctypes
import glob
import os
import re
import subprocess
import sysconfig
import tempfile

# As a GL driver compiles a shader: approximate division and root, denormals are 0. Sums and products that matter are
# `precise` there; so nothing is fused.
OPTIONS = ["--std=c++20", "--fmad=false", "--prec-div=false", "--prec-sqrt=false", "--ftz=true",
           "--generate-line-info", "--device-as-default-execution-space", "--diag-suppress=177,550"]


def find(pattern):
    root = os.path.join(sysconfig.get_path("purelib"), "nvidia")
    found = sorted(glob.glob(os.path.join(root, "*", pattern)))
    if not found:
        raise SystemExit(f"{pattern} is not below {root}; start this by ./run bench kernels")
    return found[0]


class Compiler:
    def __init__(self):
        self.library = ctypes.CDLL(find("lib/libnvrtc.so.*"))
        self.nvdisasm, self.cuobjdump = find("bin/nvdisasm"), find("bin/cuobjdump")

    def version(self):
        major, minor = ctypes.c_int(), ctypes.c_int()
        self.check(self.library.nvrtcVersion(ctypes.byref(major), ctypes.byref(minor)))
        return f"{major.value}.{minor.value}"

    def check(self, code, log=""):
        if code != 0:
            self.library.nvrtcGetErrorString.restype = ctypes.c_char_p
            raise RuntimeError(self.library.nvrtcGetErrorString(code).decode() + "\n" + log)

    def cubin(self, cuda, name, arch):
        """The machine code for an architecture such as sm_90."""
        nvrtc, program = self.library, ctypes.c_void_p()
        self.check(nvrtc.nvrtcCreateProgram(ctypes.byref(program), cuda.encode(), name.encode(), 0, None, None))
        options = [option.encode() for option in OPTIONS + [f"--gpu-architecture={arch}"]]
        code = nvrtc.nvrtcCompileProgram(program, len(options), (ctypes.c_char_p * len(options))(*options))
        size = ctypes.c_size_t()
        nvrtc.nvrtcGetProgramLogSize(program, ctypes.byref(size))
        log = ctypes.create_string_buffer(size.value + 1)
        nvrtc.nvrtcGetProgramLog(program, log)
        self.check(code, log.value.decode())
        self.check(nvrtc.nvrtcGetCUBINSize(program, ctypes.byref(size)))
        cubin = ctypes.create_string_buffer(size.value)
        self.check(nvrtc.nvrtcGetCUBIN(program, cubin))
        nvrtc.nvrtcDestroyProgram(ctypes.byref(program))
        return cubin.raw

    def disassembled(self, cubin):
        with tempfile.NamedTemporaryFile(suffix=".cubin") as file:
            file.write(cubin)
            file.flush()
            return subprocess.run([self.nvdisasm, "-c", "-gi", file.name], capture_output=True, text=True,
                                  check=True).stdout

    def usage(self, cubin):
        """Registers of an invocation, bytes of its stack (spills), bytes of shared memory of a group."""
        with tempfile.NamedTemporaryFile(suffix=".cubin") as file:
            file.write(cubin)
            file.flush()
            text = subprocess.run([self.cuobjdump, "-res-usage", file.name], capture_output=True, text=True,
                                  check=True).stdout
        return {key: int(re.search(rf"\b{name}:(\d+)", text).group(1))
                for key, name in (("registers", "REG"), ("stack_bytes", "STACK"), ("shared_bytes", "SHARED"))}
