#include "server/solver/gl_compute/kernel_compiler.h"

#include <spdlog/spdlog.h>

#include <array>
#include <cstddef>
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

// Mesa's llvmpipe makes machine code at the first dispatch, ten times as long as linking takes, and
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

 private:
  static void Dispatch(const gl::Program& program) {
    program.Use();
    glDispatchCompute(1, 1, 1);
    glFinish();
  }

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
    if (choice->variant.strip_solve == StripSolve::kElimination) return kernels.status();
    traits.strip_solve = StripSolve::kElimination;
  }
}

void KernelCompiler::Prepare(const SceneModel& model, const ClothParameters& parameters) {
  const PlannedCloth cloth = PlanOnDevice(model, parameters);
  const auto usual = ChooseKernels(
      cloth, traits_, [this](const KernelVariant& variant) { return Compile(variant); });
  if (!usual.ok()) return;
  if (!usual->choice.variant.Has(Feature::kEnergyWatch) || !HasCalmerScheme(cloth.plan)) return;
  const ClothParameters calmer = WithCalmerScheme(parameters);
  const Result<VariantChoice> choice = ChooseVariant(PlanOnDevice(model, calmer), traits_);
  if (choice.ok()) CompileLater(choice->variant);
}

bool KernelCompiler::Post(std::deque<Task>& tasks, Task task) {
  {
    const std::lock_guard lock(mutex_);
    if (is_stopping_) return false;
    tasks.push_back(std::move(task));
    if (!thread_.joinable()) thread_ = std::thread([this] { Loop(); });
  }
  wake_.notify_one();
  return true;
}

std::optional<KernelCompiler::Compiled> KernelCompiler::Known(const KernelVariant& variant) {
  const std::lock_guard lock(mutex_);
  if (is_stopping_) return Compiled(Ended());
  return cache_->Known(variant);
}

KernelCompiler::Compiled KernelCompiler::Compile(const KernelVariant& variant) {
  if (std::optional<Compiled> known = Known(variant)) return std::move(*known);
  Task task{variant, {}};
  std::future<Compiled> compiled = task.compiled.get_future();
  if (!Post(tasks_, std::move(task))) return Ended();
  return compiled.get();
}

void KernelCompiler::CompileLater(const KernelVariant& variant) {
  if (!Known(variant)) Post(later_, {variant, {}});
}

void KernelCompiler::Loop() {
  const Result<std::unique_ptr<gl::Context>> context = gl::Context::Create({.share_with = device_});
  if (!context.ok()) {
    spdlog::warn("kernels_compiled_on_device_thread reason=\"{}\"", context.status().message());
  }
  Result<FirstDispatches> first = context.ok() && traits_.is_software
                                      ? FirstDispatches::Create()
                                      : Status(StatusCode::kUnavailable, "", "");
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return is_stopping_ || !tasks_.empty() || !later_.empty(); });
    if (is_stopping_ || !context.ok()) break;
    std::deque<Task>& next = tasks_.empty() ? later_ : tasks_;
    Task task = std::move(next.front());
    next.pop_front();
    lock.unlock();
    Compiled compiled = cache_->ForVariant(task.variant);
    // Another context may use a program once its linking is over.
    glFinish();
    if (compiled.ok() && first.ok()) first->Run(**compiled);
    task.compiled.set_value(std::move(compiled));
    lock.lock();
  }
  is_stopping_ = true;
  for (Task& task : tasks_) task.compiled.set_value(Ended());
  tasks_.clear();
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
