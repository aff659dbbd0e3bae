// Work that stops wherever it is while others have the device, and goes on later.
#pragma once

#include <exception>
#include <functional>
#include <memory>
#include <semaphore>
#include <thread>

#include "server/core/interruption.h"
#include "server/solver/pause.h"

namespace drape {

// Has a thread of its own, which works only while another one waits in Continue. So the work needs
// to know nothing of where it may stop but that it calls Check there, however deep.
class PausableWork final : public Interruption {
 public:
  // `pause` is that of the piece under way.
  using Work = std::function<void(Interruption& interruption, const Pause& pause)>;

  // Null: there is no thread for it.
  static std::unique_ptr<PausableWork> Begin(Work work);
  // Work that has stopped is dropped: WorkStopped is thrown where it did.
  ~PausableWork();
  PausableWork(const PausableWork&) = delete;
  PausableWork& operator=(const PausableWork&) = delete;

  // Begins, or goes on, until the pause is due. Whether the work has ended; throws what it threw.
  // Once it has ended, or thrown, only the destructor may be called.
  [[nodiscard]] bool Continue(const Pause& pause);
  // By the work.
  void Check() override;

 private:
  explicit PausableWork(Work work);

  void Run();

  const Work work_;
  Pause pause_ = Pause::Never();
  bool is_dropped_ = false;
  bool is_over_ = false;
  std::exception_ptr failure_;
  std::binary_semaphore may_work_{0}, has_stopped_{0};
  std::thread thread_;
};

}  // namespace drape
