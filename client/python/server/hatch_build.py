"""Puts the program of build/release into the wheel, without its symbols, and gives the wheel the tag of this platform
(auditwheel then adds the libraries; see `./run wheels`)."""

import pathlib
import shutil
import subprocess
import sysconfig

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class ProgramHook(BuildHookInterface):
    def initialize(self, version, build_data):
        root = pathlib.Path(self.root)
        built = root.parents[2] / "build/release/bin/draped"
        if not built.is_file():
            raise FileNotFoundError(f"{built} is not there: ./run build comes first")
        program = root / "src/drape_server/bin/draped"
        program.parent.mkdir(exist_ok=True)
        shutil.copy(built, program)
        subprocess.run(["strip", program], check=True)
        build_data["tag"] = "py3-none-" + sysconfig.get_platform().replace("-", "_").replace(".", "_")
        build_data["pure_python"] = False
