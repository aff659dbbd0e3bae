// A new process in place of this one, for a server whose device is lost.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace drape {

// What a process leaves to the one that takes its place. It keeps its process id.
struct FormerRun {
  std::vector<double> losses_unix_s;                          // of devices, by it and before it
  bool had_gpu = false;                                       // its backend was on a hardware GPU
  int port = 0;                                               // that it served; 0: it was no server
  std::vector<std::pair<std::string, std::string>> sessions;  // with it; their names, their tenants
};

// What this process was left; empty at an ordinary start. Call it once, before other threads.
FormerRun TakeFormerRun();

// While it exists, a lost device ends in a new process: the same program with the same arguments.
// Every open file but the standard ones is closed, other threads end where they are. If devices
// were lost kMaxLosses times within kLossWindow_s a supervisor, or a person, should look: then the
// process ends with status 1.
class LossHandling {
 public:
  static constexpr size_t kMaxLosses = 5;
  static constexpr double kLossWindow_s = 600;

  // Leaves what this process was left, with one loss more, until Replace.
  LossHandling(std::vector<std::string> arguments, FormerRun former);
  ~LossHandling();
  LossHandling(const LossHandling&) = delete;
  LossHandling& operator=(const LossHandling&) = delete;

  // From now on `what_is_left` is called, on the thread that finds the loss; losses are added to
  // it. Null: a loss ends the process from now on.
  void Replace(std::function<FormerRun()> what_is_left);

 private:
  const std::vector<std::string> arguments_;
  const std::vector<double> former_losses_unix_s_;
};

}  // namespace drape
