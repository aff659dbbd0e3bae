// Kernels compiled beside the device thread, so that the first cloth of a kind does not make all
// others wait.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <map>
#include <mutex>
#include <set>
#include <thread>
#include <utility>
#include <vector>

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
  // The device's context, and what `traits` and `cache` refer to, must exist until Stop. `others`:
  // linked kernels that are not of a variant.
  KernelCompiler(KernelCache* cache, const gl::ShareHandle& device, const DeviceTraits& traits,
                 std::vector<const gl::Program*> others = {})
      : cache_(cache), device_(device), traits_(traits), others_(std::move(others)) {}
  ~KernelCompiler() { Stop(); }
  KernelCompiler(const KernelCompiler&) = delete;
  KernelCompiler& operator=(const KernelCompiler&) = delete;

  // Returns once the kernels of such a cloth are compiled, which may take seconds, or cannot be:
  // then the device thread finds out why. The kernels of its calmer scheme (energy_watch.h) are
  // compiled after all that somebody waits for. Not on the device thread.
  void Prepare(const SceneModel& model, const ClothParameters& parameters);
  // Whether nobody need wait for this variant: it is compiled, or cannot be. If not, it will be,
  // from the first call on. Thread-safe, returns at once.
  bool IsCompiled(const KernelVariant& variant);
  // Whether the other kernels have been dispatched once, where that takes long. If not, they will
  // be, from the first call on, or after the first variant. Thread-safe, returns at once.
  bool AreOthersReady();
  // Waits for the kernel that is being compiled; later calls of Prepare do nothing.
  void Stop();

 private:
  using Compiled = Result<const StepKernels*>;
  // Asked for, until it is compiled and has been dispatched once.
  struct UnderWay {
    std::promise<Compiled> promise;
    std::shared_future<Compiled> compiled = promise.get_future().share();
  };

  Compiled Compile(const KernelVariant& variant);
  void CompileLater(const KernelVariant& variant);
  // The one entry of `variant`; null: the cache knows it already, or nothing is compiled any more.
  // With mutex_ held.
  UnderWay* Ask(const KernelVariant& variant);
  void StartThread();  // with mutex_ held
  void Loop();

  KernelCache* const cache_;  // may be gone once this is stopping
  const gl::ShareHandle device_;
  const DeviceTraits traits_;
  const std::vector<const gl::Program*> others_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::map<KernelVariant, UnderWay> under_way_;
  // Variants that are under way, or were: one that somebody comes to wait for stands in both.
  std::deque<KernelVariant> waited_for_;
  std::deque<KernelVariant> later_;
  std::set<KernelVariant> failed_;  // nobody shall wait for these again
  bool are_others_due_ = false;
  bool are_others_ready_ = false;
  bool is_stopping_ = false;
  std::thread thread_;
};

}  // namespace drape
