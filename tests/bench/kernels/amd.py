"""What AMD's chips would run: registers, spills, shared memory and waves, by RADV's compiler (ACO) for hardware that is not
there (RADV_FORCE_FAMILY).

glslang makes SPIR-V for Vulkan out of the kernel's GLSL, with its relaxed rules (-R), which put the uniforms into a block of
their own. Debian packages: glslang-tools, spirv-tools, mesa-vulkan-drivers; from PyPI: vulkan.
"""
import os
import re
import resource
import subprocess
import tempfile

# RADV's name of the family -> a card of it.
FAMILIES = {"VEGA20": "Instinct MI50", "ARCTURUS": "Instinct MI100", "NAVI21": "Radeon RX 6900", "GFX1100": "Radeon RX 7900"}
DRIVER = "/usr/share/vulkan/icd.d/radeon_icd.x86_64.json"
EXTENSION = "VK_KHR_pipeline_executable_properties"
# What a statistic of the driver is called here.
STATISTICS = {"VGPRs": "vector_registers", "SGPRs": "scalar_registers", "Spilled VGPRs": "spilled_vectors",
              "Spilled SGPRs": "spilled_scalars", "LDS size": "shared_bytes", "Scratch size": "scratch_bytes",
              "Subgroups per SIMD": "waves_per_simd", "Code size": "code_bytes", "Instructions": "instructions"}
# glslang copies constant arrays without end in some kernels: better no row than no memory.
MEMORY_BYTES = 2 << 30
PATIENCE_S = 120


def spirv(glsl):
    """The SPIR-V of a kernel; None where glslang 12 runs out of memory."""
    with tempfile.TemporaryDirectory(prefix="drape-spirv-") as folder:
        source, binary = os.path.join(folder, "kernel.comp"), os.path.join(folder, "kernel.spv")
        with open(source, "w", encoding="utf-8") as file:
            file.write(glsl)
        done = subprocess.run(
            ["glslangValidator", "-R", "--target-env", "vulkan1.2", "--auto-map-bindings", "--auto-map-locations", "-o", binary, source],
            capture_output=True, text=True, check=False, timeout=PATIENCE_S,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES)))
        if "bad_alloc" in done.stderr:
            return None
        if done.returncode != 0:
            raise SystemExit(f"kernels/amd.py: glslangValidator:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
        with open(binary, "rb") as file:
            return file.read()


def blocks_of(code):
    """Binding -> storage class of the kernel's blocks."""
    text = subprocess.run(["spirv-dis", "--raw-id", "--no-color", "-"], input=code, capture_output=True, check=True).stdout.decode()
    classes = dict(re.findall(r"(%\d+) = OpVariable %\d+ (\w+)", text))
    return {int(binding): classes[name] for name, binding in re.findall(r"OpDecorate (%\d+) Binding (\d+)", text)}


class Compiler:
    """RADV for a family of chips; no device is needed."""

    def __init__(self, family):
        os.environ.update(RADV_FORCE_FAMILY=family, VK_ICD_FILENAMES=DRIVER, MESA_SHADER_CACHE_DISABLE="true")
        import vulkan
        self._vk = vk = vulkan
        self._family = family
        application = vk.VkApplicationInfo(pApplicationName="drape", apiVersion=vk.VK_MAKE_VERSION(1, 2, 0))
        instance = vk.vkCreateInstance(vk.VkInstanceCreateInfo(pApplicationInfo=application), None)
        chip, = vk.vkEnumeratePhysicalDevices(instance)
        self._mesa = self._version(chip)
        wanted = vk.VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR(pipelineExecutableInfo=True)
        queue = vk.VkDeviceQueueCreateInfo(queueFamilyIndex=0, queueCount=1, pQueuePriorities=[1.0])
        self._device = vk.vkCreateDevice(chip, vk.VkDeviceCreateInfo(
            pNext=wanted, queueCreateInfoCount=1, pQueueCreateInfos=[queue], enabledExtensionCount=1,
            ppEnabledExtensionNames=[EXTENSION]), None)
        self._statistics = vk.vkGetDeviceProcAddr(self._device, "vkGetPipelineExecutableStatisticsKHR")

    def _version(self, chip):
        """Of Mesa, as its drivers pack it into 32 bits."""
        packed = self._vk.vkGetPhysicalDeviceProperties(chip).driverVersion
        return f"{packed >> 22}.{packed >> 12 & 0x3ff}.{packed & 0xfff}"

    def row(self, code):
        """What the driver tells of a kernel, by the names of STATISTICS."""
        vk = self._vk
        kinds = {"StorageBuffer": vk.VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, "Uniform": vk.VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER}
        bindings = [vk.VkDescriptorSetLayoutBinding(binding=binding, descriptorType=kinds[storage], descriptorCount=1,
                                                    stageFlags=vk.VK_SHADER_STAGE_COMPUTE_BIT)
                    for binding, storage in blocks_of(code).items()]
        blocks = vk.vkCreateDescriptorSetLayout(
            self._device, vk.VkDescriptorSetLayoutCreateInfo(bindingCount=len(bindings), pBindings=bindings), None)
        layout = vk.vkCreatePipelineLayout(self._device, vk.VkPipelineLayoutCreateInfo(setLayoutCount=1, pSetLayouts=[blocks]), None)
        module = vk.vkCreateShaderModule(self._device, vk.VkShaderModuleCreateInfo(codeSize=len(code), pCode=code), None)
        stage = vk.VkPipelineShaderStageCreateInfo(stage=vk.VK_SHADER_STAGE_COMPUTE_BIT, module=module, pName="main")
        pipeline = vk.vkCreateComputePipelines(self._device, None, 1, [vk.VkComputePipelineCreateInfo(
            flags=vk.VK_PIPELINE_CREATE_CAPTURE_STATISTICS_BIT_KHR, stage=stage, layout=layout)], None)[0]
        told = {}
        for statistic in self._statistics(self._device, vk.VkPipelineExecutableInfoKHR(pipeline=pipeline, executableIndex=0)):
            name = statistic.name if isinstance(statistic.name, str) else vk.ffi.string(statistic.name).decode()
            told[name] = statistic.value.u64
        vk.vkDestroyPipeline(self._device, pipeline, None)
        return {"family": self._family, "mesa": self._mesa, **{ours: told[theirs] for theirs, ours in STATISTICS.items()}}


def count(texts):
    """A row of each program and family. texts: name -> GLSL."""
    codes = {name: spirv(glsl) for name, glsl in texts.items()}
    for name in [name for name, code in codes.items() if code is None]:
        print(f"{name:42} AMD: not counted, glslang runs out of memory", flush=True)
    rows = []
    for family in FAMILIES:
        compiler = Compiler(family)
        for name, code in codes.items():
            if code is not None:
                rows.append({"program": name, **compiler.row(code)})
                print(f"{name:42} {family:8} {rows[-1]['vector_registers']:4} vector registers {rows[-1]['scratch_bytes']:5} B scratch "
                      f"{rows[-1]['shared_bytes']:6} B shared {rows[-1]['waves_per_simd']:3} waves per SIMD", flush=True)
    return rows
