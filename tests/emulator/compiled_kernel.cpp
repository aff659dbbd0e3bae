#include "tests/emulator/compiled_kernel.h"

#include <dlfcn.h>
#include <unistd.h>

#include <charconv>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <sstream>

#include "server/core/check.h"
#include "tests/bench/shell.h"
#include "tests/support/paths/paths.h"

namespace drape::emulator {

namespace {

namespace fs = std::filesystem;

// Rounded as written; frames that barriers can compare, and no call of theirs twice in the code.
constexpr const char* kFlags =
    " -std=c++20 -O1 -g1 -fPIC -fvisibility=hidden -ffp-contract=off"
    " -fno-omit-frame-pointer -fno-optimize-sibling-calls -fno-thread-jumps "
    "-fno-tree-dominator-opts -fno-strict-aliasing -w";
constexpr const char* kOwnFiles[] = {"translate.py", "glsl.h", "glsl_vectors.h",
                                     "kernel_interface.h"};

std::string OwnPath(const char* file) {
  return test::SourcePath(std::string("tests/emulator/") + file).string();
}

std::string WithoutLocalSize(const std::string& glsl) {
  std::istringstream lines(glsl);
  std::string text;
  for (std::string line; std::getline(lines, line);) {
    text += (line.starts_with("#define LOCAL_SIZE ") ? "" : line) + "\n";
  }
  return text;
}

void RunOrDie(const std::string& command) {
  const bench::Ending ending = bench::RunShell(command);
  DRAPE_CHECK(ending.exit_status == 0, command + "\n" + ending.text);
}

// Writes `path`.so, in another folder until it is whole.
void Compile(const std::string& path, const std::string& glsl,
             const std::vector<gl::SourceLine>& lines) {
  const std::string own = path + "." + std::to_string(getpid());
  std::string origins;
  for (const gl::SourceLine& line : lines) {
    origins += line.file + ":" + std::to_string(line.line) + "\n";
  }
  bench::WriteFile(own + "/kernel.glsl", glsl);
  bench::WriteFile(own + "/kernel.lines", origins);
  // Compiled apart from linking, under names that are always the same: the compiler's cache knows
  // it in a new build folder.
  const std::string compiler = test::CompilerCommand();
  RunOrDie("cd '" + own + "' && python3 -B '" + OwnPath("translate.py") +
           "' kernel.glsl kernel.lines > kernel.cpp && " + compiler + kFlags + " -I '" +
           OwnPath("") + "' -c kernel.cpp -o kernel.o && " + compiler +
           " -shared kernel.o -o kernel.so");
  fs::rename(own + "/kernel.so", path + ".so");
  fs::remove_all(own);
}

std::string PathOf(const std::string& text, const std::vector<gl::SourceLine>& lines) {
  static const std::string own = [] {
    std::string all = kFlags;
    for (const char* file : kOwnFiles) all += bench::ReadText(OwnPath(file));
    return all + bench::ReadText(test::SourcePath("tests/bench/kernels/translate.py"));
  }();
  std::string all = own + text;
  for (const gl::SourceLine& line : lines) all += line.file + std::to_string(line.line);
  std::ostringstream name;
  name << std::hex << std::hash<std::string>()(all);
  return test::BuildPath("tests/emulator/kernels/" + name.str()).string();
}

}  // namespace

const CompiledKernel& CompiledKernel::Load(const std::string& glsl,
                                           const std::vector<gl::SourceLine>& lines) {
  static auto& loaded = *new std::map<std::string, std::unique_ptr<CompiledKernel>>;
  const std::string path = PathOf(WithoutLocalSize(glsl), lines);
  std::unique_ptr<CompiledKernel>& kernel = loaded[path];
  if (kernel) return *kernel;
  if (!fs::exists(path + ".so")) Compile(path, WithoutLocalSize(glsl), lines);
  kernel = std::make_unique<CompiledKernel>();
  kernel->path_ = path + ".so";
  void* library = dlopen(kernel->path_.c_str(), RTLD_NOW | RTLD_LOCAL);
  DRAPE_CHECK(library != nullptr, dlerror());
  kernel->entry_ = static_cast<const KernelEntry*>(dlsym(library, "drape_emulated_kernel"));
  DRAPE_CHECK(kernel->entry_ != nullptr, dlerror());
  Dl_info info{};
  DRAPE_CHECK(dladdr(kernel->entry_, &info) != 0, kernel->path_);
  kernel->base_ = static_cast<const std::byte*>(info.dli_fbase);
  return *kernel;
}

std::string CompiledKernel::LineOf(const void* place) const {
  std::ostringstream command;
  // The place is where the call returns to.
  command << "addr2line -i -e '" << path_ << "' " << std::hex
          << static_cast<const std::byte*>(place) - base_ - 1;
  std::istringstream frames(bench::RunShell(command.str()).text);
  std::string lines;
  for (std::string frame; std::getline(frames, frame);) {
    if (frame.find("glsl.h:") != std::string::npos) continue;
    if (frame.find("glsl_vectors.h:") != std::string::npos) continue;
    frame = frame.substr(0, frame.find(" ("));
    // The folder of the compiler stands before it.
    const size_t folder = frame.rfind("/", frame.rfind("/") - 1);
    return frame.substr(folder == std::string::npos ? 0 : folder + 1);
  }
  return "?";
}

std::string CompiledKernel::Describe(const Findings& findings) const {
  std::string text;
  for (const Finding& finding : findings.all()) {
    text += std::string(NameOf(finding.fault)) + " at " + LineOf(finding.place);
    if (finding.other_place != nullptr) text += " and " + LineOf(finding.other_place);
    text += ": " + finding.what + " (" + std::to_string(finding.count) + " times)\n";
  }
  return text;
}

std::string WithDefine(const std::string& glsl, const std::string& name) {
  const size_t end = glsl.find('\n');
  return glsl.substr(0, end + 1) + "#define " + name + "\n" + glsl.substr(end + 1);
}

uint32_t LocalSizeOf(const std::string& glsl) {
  const std::string define = "#define LOCAL_SIZE ";
  const size_t at = glsl.find(define);
  DRAPE_CHECK(at != std::string::npos, "the kernel has no local size");
  uint32_t size = 0;
  std::from_chars(glsl.data() + at + define.size(), glsl.data() + glsl.size(), size);
  return size;
}

}  // namespace drape::emulator
