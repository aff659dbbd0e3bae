#include "server/solver/gl_compute/kernel_compiler.h"

#include <spdlog/spdlog.h>

#include <array>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "server/gl/buffer.h"
#include "server/gl/sync.h"
#include "server/solver/energy_watch.h"
#include "shaders/interface/bindings.h"

namespace drape {

namespace {

// An item, a record, a model and a state of a cloth without particles, constraints and substeps.
constexpr size_t kEmptyBytes = 64 * 1024;
constexpr std::array kStorage = {DRAPE_BINDING_ITEMS,      DRAPE_BINDING_CLOTHS,
                                 DRAPE_BINDING_MODELS,     DRAPE_BINDING_STATES,
                                 DRAPE_BINDING_PARAMETERS, DRAPE_BINDING_SCRATCH,
                                 DRAPE_BINDING_STATUSES,   DRAPE_BINDING_DISPATCHES};

// Mesa's llvmpipe makes machine code at the first dispatch, which takes longer than linking, and
// keeps it for all contexts (in its cache on disk). So each kernel steps a cloth of nothing once.
// Hardware drivers make theirs when they link. Without that cache, the device thread compiles
// again.
class FirstDispatches {
 public:
  static Result<FirstDispatches> Create() {
    FirstDispatches made;
    const std::vector<std::byte> zeros(kEmptyBytes);
    for (const GLuint binding : kStorage) {
      Result<gl::Buffer> buffer = gl::Buffer::Create(kEmptyBytes);
      if (!buffer.ok()) return buffer.status();
      buffer->Upload(0, zeros);
      buffer->BindStorage(binding);
      made.buffers_.push_back(std::move(buffer).value());
    }
    return made;
  }

  void Run(const StepKernels& kernels) const {
    if (kernels.resident_step != nullptr) Dispatch(*kernels.resident_step);
    for (const TiledKernel& kernel : TiledKernels()) {
      const gl::Program* program = kernels.*kernel.program;
      if (program != nullptr) Dispatch(*program);
    }
  }

  static void Dispatch(const gl::Program& program) {
    program.Use();
    glDispatchCompute(1, 1, 1);
    glFinish();
  }

 private:
  std::vector<gl::Buffer> buffers_;
};

Status Ended() {
  return Status(StatusCode::kUnavailable, "DRAINING", "the backend ends");
}

}  // namespace

Result<KernelChoice> ChooseKernels(
    const PlannedCloth& cloth, DeviceTraits traits,
    const std::function<Result<const StepKernels*>(const KernelVariant&)>& compile) {
  while (true) {
    Result<VariantChoice> choice = ChooseVariant(cloth, traits);
    if (!choice.ok()) return choice.status();
    const Result<const StepKernels*> kernels = compile(choice->variant);
    if (kernels.ok()) return KernelChoice{std::move(choice).value(), kernels.value()};
    const StripSolve refused = choice->variant.strip_solve;
    if (refused == StripSolve::kElimination) return kernels.status();
    traits.strip_solve =
        IsReduction(refused) ? StripSolve::kFromBothEnds : StripSolve::kElimination;
  }
}

void KernelCompiler::Prepare(const SceneModel& model, const ClothParameters& parameters) {
  const PlannedCloth cloth = PlanOnDevice(model, parameters);
  const auto usual = ChooseKernels(
      cloth, traits_, [this](const KernelVariant& variant) { return Compile(variant); });
  if (!usual.ok()) return;
  if (!usual->choice.variant.Has(Feature::kEnergyWatch) || !HasCalmerScheme(cloth.plan)) return;
  const ClothParameters calmer = WithCalmerScheme(parameters);
  DeviceTraits traits = traits_;
  if (usual->choice.variant.Has(StepStage::kSolveStrips)) {
    traits.strip_solve = usual->choice.variant.strip_solve;  // perhaps the device refused another
  }
  const Result<VariantChoice> choice = ChooseVariant(PlanOnDevice(model, calmer), traits);
  if (choice.ok()) CompileLater(choice->variant);
}

KernelCompiler::UnderWay* KernelCompiler::Ask(const KernelVariant& variant) {
  if (is_stopping_) return nullptr;
  const auto known = under_way_.find(variant);
  if (known != under_way_.end()) return &known->second;
  if (cache_->Known(variant)) return nullptr;
  StartThread();
  return &under_way_[variant];
}

void KernelCompiler::StartThread() {
  if (!thread_.joinable()) thread_ = std::thread([this] { Loop(); });
}

KernelCompiler::Compiled KernelCompiler::Compile(const KernelVariant& variant) {
  std::shared_future<Compiled> compiled;
  {
    const std::lock_guard lock(mutex_);
    const UnderWay* const entry = Ask(variant);
    if (entry == nullptr) return is_stopping_ ? Compiled(Ended()) : *cache_->Known(variant);
    compiled = entry->compiled;
    waited_for_.push_back(variant);
  }
  wake_.notify_one();
  return compiled.get();
}

void KernelCompiler::CompileLater(const KernelVariant& variant) {
  {
    const std::lock_guard lock(mutex_);
    if (under_way_.contains(variant) || Ask(variant) == nullptr) return;
    later_.push_back(variant);
  }
  wake_.notify_one();
}

bool KernelCompiler::IsCompiled(const KernelVariant& variant) {
  {
    const std::lock_guard lock(mutex_);
    if (under_way_.contains(variant)) return false;
    if (failed_.contains(variant) || Ask(variant) == nullptr) return true;
    waited_for_.push_back(variant);
  }
  wake_.notify_one();
  return false;
}

bool KernelCompiler::AreOthersReady() {
  {
    const std::lock_guard lock(mutex_);
    if (!traits_.is_software || are_others_ready_ || is_stopping_) return true;
    are_others_due_ = true;
    StartThread();
  }
  wake_.notify_one();
  return false;
}

void KernelCompiler::Loop() {
  const Result<std::unique_ptr<gl::Context>> context = gl::Context::Create({.share_with = device_});
  if (!context.ok()) {
    spdlog::warn("kernels_compiled_on_device_thread reason=\"{}\"", context.status().message());
  }
  std::optional<FirstDispatches> first;
  if (context.ok() && traits_.is_software) {
    Result<FirstDispatches> made = FirstDispatches::Create();
    if (made.ok()) {
      first = std::move(made).value();
    } else {
      spdlog::warn("kernels_not_dispatched_ahead reason=\"{}\"", made.status().message());
    }
  }
  std::unique_lock lock(mutex_);
  while (true) {
    const auto must_do_others = [this] { return are_others_due_ && !are_others_ready_; };
    wake_.wait(lock, [&] {
      return is_stopping_ || must_do_others() || !waited_for_.empty() || !later_.empty();
    });
    if (is_stopping_ || !context.ok()) break;
    if (must_do_others()) {
      lock.unlock();
      for (const gl::Program* const program : others_) {
        if (first) FirstDispatches::Dispatch(*program);
      }
      lock.lock();
      are_others_ready_ = true;
      continue;
    }
    std::deque<KernelVariant>& next = waited_for_.empty() ? later_ : waited_for_;
    const KernelVariant variant = next.front();
    next.pop_front();
    if (!under_way_.contains(variant)) continue;  // it stood in both
    lock.unlock();
    Compiled compiled = cache_->ForVariant(variant);
    if (compiled.ok() && first) first->Run(**compiled);
    lock.lock();
    are_others_due_ = true;
    if (!compiled.ok()) failed_.insert(variant);
    under_way_.extract(variant).mapped().promise.set_value(std::move(compiled));
  }
  is_stopping_ = true;
  for (auto& [variant, entry] : under_way_) entry.promise.set_value(Ended());
  under_way_.clear();
}

void KernelCompiler::Stop() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
  }
  wake_.notify_one();
  if (thread_.joinable()) thread_.join();
}

}  // namespace drape
