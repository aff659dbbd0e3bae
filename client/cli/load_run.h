// The clients of `drape load`: each a thread with a connection and a session of its own.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "client/cli/load_report.h"
#include "drape/client.h"
#include "drape/scene_player.h"

namespace drape::cli {

using LoadClock = std::chrono::steady_clock;

// What one request is.
enum class LoadRequest {
  kStep,     // a Step of all cloths of the client's session
  kCreate,   // creating the scene's cloths and deleting them
  kSession,  // creating a session and the scene's cloths, and deleting the session
};

// What the clients do.
struct LoadPlan {
  std::function<Client()> connect;
  v1::Scene scene;  // the cloths of each client
  v1::ServerInfo::Limits limits;
  LoadRequest request = LoadRequest::kStep;
  uint32_t steps = 1;              // per request
  bool has_positions = false;      // the answer brings them
  bool by_stream = false;          // StepStream instead of Step
  double interval_s = 5;           // of a window
  uint64_t request_count = 0;      // a window ends after these, too; 0: no such end
  uint32_t warm_up_requests = 10;  // of each client before its first window
  bool is_poisson = false;         // arrivals of a rate; otherwise evenly spaced
  uint32_t viewers = 0;            // that follow sessions and read every frame
  double viewer_hz = 50;
  uint32_t stalled_viewers = 0;  // that subscribe and never read
};

// When the answers to steps came: the age of a frame counts from there. Thread-safe.
class AnswerTimes {
 public:
  void Add(uint64_t step, LoadClock::time_point at);
  // Of the answer that said that `step` is complete; unset when it has not come yet, or is long
  // ago.
  std::optional<LoadClock::time_point> Of(uint64_t step) const;

 private:
  mutable std::mutex mutex_;
  std::deque<std::pair<uint64_t, LoadClock::time_point>> answers_;  // by step
};

// Send times of a window, shared by its clients. Thread-safe.
class LoadSchedule {
 public:
  LoadSchedule(const LoadPlan& plan, double rate_per_s, LoadClock::time_point start);

  // When the next request is due; unset: the window is over. Without a rate that is now.
  std::optional<LoadClock::time_point> Next();
  // Requests that were due within the window, but had no client to send them.
  uint64_t CountUnsent();

 private:
  std::optional<LoadClock::time_point> Draw();

  const double rate_per_s_;
  const uint64_t request_count_;
  const bool is_poisson_;
  const LoadClock::time_point end_;
  std::mutex mutex_;
  std::mt19937_64 random_{1};  // the same arrivals in every run
  LoadClock::time_point due_;
  uint64_t drawn_ = 0;
};

// One client. Its requests are made by one thread at a time.
class LoadClient {
 public:
  explicit LoadClient(const LoadPlan& plan);

  // Requests that do not count. Failures are left to the window.
  void WarmUp();
  // Makes requests until the schedule is over.
  LoadSamples Run(LoadSchedule& schedule);
  const std::string& session_name();
  const AnswerTimes& answers() const { return answers_; }

 private:
  // Throws drape::Error.
  void Request(LoadSamples& samples);
  void Step(LoadSamples& samples);
  // Makes what is missing: the first time, or after an error that may have lost it.
  void Prepare();
  // Counts the error and waits a little; the next request prepares again what may be lost.
  void Failed(const Error& error, LoadSamples& samples);

  const LoadPlan& plan_;
  Client client_;
  std::optional<Session> session_;
  bool has_cloths_ = false;
  std::optional<StepStream> stream_;
  AnswerTimes answers_;
};

// All clients of a run; they stay from level to level.
class LoadClients {
 public:
  explicit LoadClients(const LoadPlan& plan) : plan_(plan) {}

  // One window. Clients that are missing are made and warmed up before.
  LoadSamples RunWindow(const LoadLevel& level);

 private:
  const LoadPlan& plan_;
  std::vector<std::unique_ptr<LoadClient>> clients_;
};

}  // namespace drape::cli
