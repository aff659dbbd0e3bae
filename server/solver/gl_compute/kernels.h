// Compiled kernels, one program per kernel and variant.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>

#include "server/core/status.h"
#include "server/gl/program.h"
#include "server/gl/program_store.h"
#include "server/gl/shader_source.h"
#include "server/solver/gl_compute/kernel_variant.h"

namespace drape {

// The programs that step the cloths of one variant. Programs of the other plan, and of stages that
// the variant leaves out, are null.
struct StepKernels {
  KernelVariant variant;
  const gl::Program* resident_step = nullptr;
  const gl::Program* tiled_begin = nullptr;
  const gl::Program* tiled_find_range = nullptr;
  const gl::Program* tiled_find_near = nullptr;
  const gl::Program* tiled_spring_accelerations = nullptr;
  const gl::Program* tiled_apply_springs = nullptr;
  const gl::Program* tiled_elastic_impulses = nullptr;
  const gl::Program* tiled_apply_elastic = nullptr;
  const gl::Program* tiled_air_impulses = nullptr;
  const gl::Program* tiled_apply_wind = nullptr;
  const gl::Program* tiled_predict = nullptr;
  const gl::Program* tiled_solve_elastic = nullptr;
  const gl::Program* tiled_apply_cells = nullptr;
  const gl::Program* tiled_hinge_impulses = nullptr;
  const gl::Program* tiled_solve_hinges = nullptr;
  const gl::Program* tiled_twist_changes = nullptr;
  const gl::Program* tiled_damp_twist = nullptr;
  const gl::Program* tiled_tether = nullptr;
  const gl::Program* tiled_find_self_contacts = nullptr;
  const gl::Program* tiled_begin_sweeps = nullptr;
  const gl::Program* tiled_solve_strips = nullptr;
  const gl::Program* tiled_test_links = nullptr;
  const gl::Program* tiled_collect_links = nullptr;
  const gl::Program* tiled_refine = nullptr;
  const gl::Program* tiled_solve_distance = nullptr;
  const gl::Program* tiled_solve_joints = nullptr;
  const gl::Program* tiled_solve_self_contacts = nullptr;
  const gl::Program* tiled_solve_contacts = nullptr;
  const gl::Program* tiled_end_sweep = nullptr;
  const gl::Program* tiled_integrate = nullptr;
  const gl::Program* tiled_guard_self_contacts = nullptr;
  const gl::Program* tiled_solve_velocity = nullptr;
  const gl::Program* tiled_correct_velocity = nullptr;
  const gl::Program* tiled_place_pins = nullptr;
  const gl::Program* tiled_watch_energy = nullptr;
  const gl::Program* tiled_check = nullptr;
  const gl::Program* tiled_commit = nullptr;
};

// A kernel of the tiled plan.
struct TiledKernel {
  const char* file = nullptr;
  TraitSet needed_by = {};  // any of these
  TraitSet reads = {};      // traits that its code depends on
  const gl::Program* StepKernels::*program = nullptr;
  uint32_t KernelVariant::*local_size = &KernelVariant::local_size;
};
std::span<const TiledKernel> TiledKernels();
// The #define block of one of them; variants that differ only in what it does not read share it.
std::string DefinesOf(const TiledKernel& kernel, const KernelVariant& variant);

// The embedded shaders, replaced by those in `shader_dir` unless it is empty. NOT_FOUND
// (SHADER_DIR_NOT_FOUND, SHADER_DIR_UNUSED).
Result<gl::ShaderLibrary> OpenShaders(const std::string& shader_dir);
// What a device compiles of `kernel`, such as "pack", in the specialisation of `defines`. Needs no
// device.
Result<gl::ShaderSource> AssembleKernel(const gl::ShaderLibrary& library, const std::string& kernel,
                                        const std::string& defines);

// Compiles on first use and keeps everything. Thread-safe; every call with a context of the
// device's share group current. Errors are INTERNAL (SHADER_COMPILE_FAILED).
class KernelCache {
 public:
  // `device_defines`: #define block of all kernels on this device. `store`: of compiled programs,
  // null for none. Errors as OpenShaders.
  static Result<std::unique_ptr<KernelCache>> Create(const std::string& shader_dir,
                                                     const std::string& device_defines,
                                                     std::unique_ptr<gl::ProgramStore> store);

  // A variant by reduction that the device has refused is not compiled again.
  Result<const StepKernels*> ForVariant(const KernelVariant& variant);
  // What ForVariant would answer at once; none: it would have to compile. Needs no context.
  std::optional<Result<const StepKernels*>> Known(const KernelVariant& variant) const;
  // A kernel without variants, "measure_pieces" or "pack"; it knows all shapes of colliders.
  Result<const gl::Program*> General(const std::string& kernel, uint32_t local_size);

 private:
  KernelCache() = default;
  Result<const gl::Program*> Compile(const std::string& kernel, const std::string& defines);
  Status CompileTiled(StepKernels& kernels);

  // Constant once the cache is made.
  gl::ShaderLibrary library_;
  std::string device_defines_;
  std::unique_ptr<const gl::ProgramStore> store_;

  mutable std::mutex mutex_;  // guards the maps; nothing is compiled while it is held
  // By kernel and defines. Pointers into a map stay valid.
  std::map<std::pair<std::string, std::string>, gl::Program> programs_;
  std::map<KernelVariant, StepKernels> variants_;
  // Variants by reduction that the device does not compile, and why.
  std::map<KernelVariant, Status> refused_;
};

}  // namespace drape
