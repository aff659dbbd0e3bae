// Kernels compiled beside the device thread, so that the first cloth of a kind does not make all
// others wait.
#pragma once

#include <condition_variable>
#include <deque>
#include <future>
#include <mutex>
#include <optional>
#include <thread>

#include "server/gl/context.h"
#include "server/scene/scene_model.h"
#include "server/solver/cloth_parameters.h"
#include "server/solver/gl_compute/kernel_variant.h"
#include "server/solver/gl_compute/kernels.h"

namespace drape {

// What ChooseVariant says once the device's refusals are known.
struct KernelChoice {
  VariantChoice choice;
  const StepKernels* kernels = nullptr;
};
// The kernels of a cloth: `compile` gives those of a variant. Strips are solved by elimination if
// the device refuses another way. Errors as ChooseVariant and KernelCache::ForVariant.
Result<KernelChoice> ChooseKernels(
    const PlannedCloth& cloth, DeviceTraits traits,
    const std::function<Result<const StepKernels*>(const KernelVariant&)>& compile);

// Thread-safe. Its thread begins with the first work and has a context of its own.
class KernelCompiler {
 public:
  // The device's context, and what `traits` and `cache` refer to, must exist until Stop.
  KernelCompiler(KernelCache* cache, const gl::ShareHandle& device, const DeviceTraits& traits)
      : cache_(cache), device_(device), traits_(traits) {}
  ~KernelCompiler() { Stop(); }
  KernelCompiler(const KernelCompiler&) = delete;
  KernelCompiler& operator=(const KernelCompiler&) = delete;

  // Returns once the kernels of such a cloth are compiled, which may take seconds, or cannot be:
  // then the device thread finds out why. The kernels of its calmer scheme (energy_watch.h) are
  // compiled after all that somebody waits for. Not on the device thread.
  void Prepare(const SceneModel& model, const ClothParameters& parameters);
  // Waits for the kernel that is being compiled; later calls of Prepare do nothing.
  void Stop();

 private:
  using Compiled = Result<const StepKernels*>;
  struct Task {
    KernelVariant variant;
    std::promise<Compiled> compiled;
  };
  // What Compile would answer at once. The cache may be gone once this is stopping.
  std::optional<Compiled> Known(const KernelVariant& variant);
  Compiled Compile(const KernelVariant& variant);
  void CompileLater(const KernelVariant& variant);
  // False: it is stopping.
  bool Post(std::deque<Task>& tasks, Task task);
  void Loop();

  KernelCache* const cache_;
  const gl::ShareHandle device_;
  const DeviceTraits traits_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Task> tasks_;  // each is waited for
  std::deque<Task> later_;
  bool is_stopping_ = false;
  std::thread thread_;
};

}  // namespace drape
