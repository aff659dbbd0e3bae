#include "tests/traffic/traffic.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <sstream>
#include <thread>

#include "server/api/sha256.h"
#include "server/core/text.h"
#include "tests/system/cutting_proxy.h"
#include "tests/system/metrics.h"
#include "tests/system/server_process.h"
#include "tests/traffic/sight.h"
#include "tests/traffic/worker.h"

namespace drape::test {
namespace {

constexpr double kPatience_s = 60;
// What clients hold of a server.
const char* const kHeld[] = {
    "drape_sessions",     "drape_cloths",           "drape_particles",   "drape_queued_requests",
    "drape_unread_bytes", "drape_remembered_bytes", "drape_saved_bytes", "drape_queued_builds"};

// A session of the run and who uses it.
struct Place {
  std::string tenant;
  std::string name;
};

class Stage {
 public:
  explicit Stage(const TrafficOptions& options) : options_(options), random_(options.seed) {}
  TrafficHistory Run();

 private:
  struct SharedSteps {
    std::vector<double> acknowledged_s;
    uint64_t open = 0;
  };

  static std::string TokenOf(const std::string& tenant) { return "token of " + tenant; }
  double Now() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }
  Client Direct(const std::string& tenant) const;
  bool StartServer();
  void Begin();
  // What a kill would lose now [s].
  double CheckpointAge_s() const {
    return MetricIn(MetricsOf(*server_), "drape_checkpoint_age_seconds");
  }
  std::map<std::string, Photo> LookAtAll() const;
  std::string Incarnation() const { return Direct("one").GetServerInfo().incarnation(); }
  // Ends the server and starts it again.
  bool Restart(bool by_drain);
  void RunWorkers();
  void End();

  const TrafficOptions options_;
  std::mt19937 random_;
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  ScratchDir dir_;
  std::mutex server_mutex_;  // for workers that ask: held while there is none
  std::unique_ptr<ServerProcess> server_;
  std::unique_ptr<CuttingProxy> proxy_;
  std::vector<Place> places_;  // the first is shared
  std::vector<std::unique_ptr<Worker>> workers_;
  TrafficBoard board_;
  std::mutex mutex_;
  std::map<std::string, SharedSteps> shared_;  // by incarnation; guarded
  uint64_t shared_cloth_ = 0;
  TrafficHistory history_;
};

Client Stage::Direct(const std::string& tenant) const {
  ConnectOptions options;
  options.ready_timeout_s = kPatience_s;
  options.token = TokenOf(tenant);
  return Client::Connect(server_->Address(), options);
}

bool Stage::StartServer() {
  server_ = std::make_unique<ServerProcess>(std::vector<std::string>{
      "--backend=cpu", "--token-file=" + (dir_ / "tokens"),
      "--checkpoint-dir=" + (dir_ / "checkpoints"), "--metrics-listen=127.0.0.1:0",
      "--checkpoint-interval-s=" + std::to_string(options_.checkpoint_interval_s)});
  return server_->WaitUntilUp();
}

std::map<std::string, Photo> Stage::LookAtAll() const {
  std::map<std::string, Photo> photos;
  for (const Place& place : places_) {
    photos[place.name] = Look(Direct(place.tenant).AttachSession(place.name)).photo;
  }
  return photos;
}

// Sessions, the shared cloth, workers. Sessions are in files before anything happens to them.
void Stage::Begin() {
  for (const char* tenant : {"one", "one", "two", "two", "three", "three"}) {
    SessionOptions options;
    options.ttl_s = 600;
    options.renews_lease = false;
    Session session = Direct(tenant).CreateSession(options);
    session.Detach();
    places_.push_back({tenant, session.name()});
  }
  const double created_s = Now();
  while (Now() - CheckpointAge_s() <= created_s && Now() < created_s + kPatience_s) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  history_.shared_session = places_[0].name;
  v1::CreateClothsRequest& shared = history_.shared_creation;
  RandomTraffic(0, true).Creation("").Swap(&shared);
  shared.set_count(1);
  shared.clear_overrides();
  SetOrigin({}, shared.mutable_environment_origins_m());
  Session session = Direct("one").AttachSession(places_[0].name);
  shared_cloth_ = session.CreateCloths(shared).cloth_ids(0);
  board_.Show("one", shared_cloth_);
  history_.runs.push_back({.incarnation = Incarnation(), .began = LookAtAll()});
  for (uint32_t k = 0; k < kWorkers; ++k) {
    const Place& place = places_[k < places_.size() ? k : 0];
    WorkerOptions options;
    options.worker = k + 1;
    options.seed = options_.seed * 1000 + k;
    options.address = proxy_->Address();
    options.tenant = place.tenant;
    options.token = TokenOf(place.tenant);
    options.session = place.name;
    options.shared_cloth = place.name == places_[0].name ? shared_cloth_ : 0;
    options.touch_themselves = options_.touch_themselves;
    options.deletes_foreign_sessions = !options_.takes_own_sessions_for_foreign;
    options.forgets_request_ids = options_.forgets_request_ids;
    for (const Place& other : places_) {
      const bool is_foreign = other.tenant != place.tenant;
      if (is_foreign != options_.takes_own_sessions_for_foreign)
        options.foreign_sessions.push_back(other.name);
    }
    workers_.push_back(std::make_unique<Worker>(std::move(options), board_));
  }
}

// Of a log.
std::vector<std::string> WorriesIn(const std::string& log) {
  std::vector<std::string> worries;
  std::istringstream lines(log);
  for (std::string line; std::getline(lines, line);) {
    for (const char* word : {"session_lost", "checkpoint_failed", "cloth_ended", " overdue"}) {
      if (line.find(word) != std::string::npos) worries.push_back(line);
    }
  }
  return worries;
}

bool Stage::Restart(bool by_drain) {
  const std::lock_guard lock(server_mutex_);
  ServerRun& run = history_.runs.back();
  const double looked_s = Now();
  const double age_s = CheckpointAge_s();
  run.ended_s = Now();
  run.kept_until_s = looked_s - age_s;
  server_->Signal(by_drain ? SIGTERM : SIGKILL);
  if (server_->WaitForExit() < 0) return false;
  if (by_drain) run.kept_until_s = std::numeric_limits<double>::infinity();
  if (!by_drain) history_.oldest_checkpoint_s = std::max(history_.oldest_checkpoint_s, age_s);
  ++(by_drain ? history_.drains : history_.kills);
  run.worries = WorriesIn(server_->Log());
  proxy_->SetTarget(0);
  if (!StartServer()) return false;
  history_.runs.push_back({.incarnation = Incarnation(), .began = LookAtAll()});
  proxy_->SetTarget(PortOf(server_->Address()));
  return true;
}

void Stage::RunWorkers() {
  std::vector<std::thread> threads;
  for (const auto& worker : workers_) threads.emplace_back([&worker] { worker->Run(); });
  const auto next_end = [this] {
    const uint64_t mean = options_.operations_per_run;
    if (mean == 0) return UINT64_MAX;
    return board_.operations + std::uniform_int_distribution(mean / 3, mean * 5 / 3)(random_);
  };
  uint64_t end = next_end();
  uint32_t ends = 0;
  while (board_.operations < options_.operations && server_->is_running()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    if (board_.operations < end) continue;
    if (!Restart(++ends % 3 == 0)) break;
    end = next_end();
  }
  EXPECT_GE(board_.operations, options_.operations) << "the server ended: " << server_->Log();
  board_.is_over = true;
  for (std::thread& thread : threads) thread.join();
}

void Stage::End() {
  history_.ended = LookAtAll();
  for (const Place& place : places_) Direct(place.tenant).AttachSession(place.name).Delete();
  for (const char* name : kHeld) {
    // What an answer held goes once it has been written, after the client may have read it.
    double value = -1;
    for (int k = 0; k < 400 && value != 0; ++k) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      value = MetricIn(MetricsOf(*server_), name);
    }
    history_.held[name] = value;
  }
  history_.runs.back().worries = WorriesIn(server_->Log());
  history_.operations = board_.operations;
  history_.repetitions = board_.repetitions;
  history_.cuts = static_cast<uint64_t>(proxy_->cuts());
  for (const auto& worker : workers_) history_.workers.push_back(std::move(worker->history()));
  for (ServerRun& run : history_.runs) {
    run.shared_acknowledged_s = shared_[run.incarnation].acknowledged_s;
    run.shared_open = shared_[run.incarnation].open;
  }
}

TrafficHistory Stage::Run() {
  std::ofstream tokens(dir_ / "tokens");
  for (const char* tenant : {"one", "two", "three"}) {
    tokens << tenant << " " << HexOf(api::Sha256Of(TokenOf(tenant))) << "\n";
  }
  tokens.close();
  if (!StartServer()) {
    ADD_FAILURE() << "no server";
    return {};
  }
  proxy_ = std::make_unique<CuttingProxy>(PortOf(server_->Address()), 400, 100'000);
  board_.now_s = [this] { return Now(); };
  board_.count_runs = [this] {
    const std::lock_guard lock(server_mutex_);
    return MetricIn(MetricsOf(*server_), "drape_runs");
  };
  board_.count_shared = [this](const std::string& incarnation, bool is_acknowledged) {
    const std::lock_guard lock(mutex_);
    SharedSteps& steps = shared_[incarnation];
    if (is_acknowledged) {
      steps.acknowledged_s.push_back(Now());
    } else {
      ++steps.open;
    }
  };
  Begin();
  RunWorkers();
  if (server_->is_running()) End();
  workers_.clear();
  return std::move(history_);
}

}  // namespace

TrafficHistory RunTraffic(const TrafficOptions& options) {
  return Stage(options).Run();
}

}  // namespace drape::test
