// A client that does random things, repeats what is not answered, and writes down what it is told.
#pragma once

#include <drape/client.h>

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "tests/system/random_traffic.h"
#include "tests/traffic/history.h"

namespace drape::test {

// Shared by the workers of a run; thread-safe.
class TrafficBoard {
 public:
  std::atomic<bool> is_over = false;
  std::atomic<uint64_t> operations = 0;  // acknowledged
  std::atomic<uint64_t> repetitions = 0;
  std::function<double()> now_s;
  // Steps of the shared cloth: told of, or given up, in the run `incarnation`.
  std::function<void(const std::string& incarnation, bool is_acknowledged)> count_shared;
  // Run calls that the server has now.
  std::function<double()> count_runs;
  // Held by the one worker that lets the server step by itself: so it sees when that is over.
  std::mutex run_turn;

  // A cloth that `tenant` has now, for those who ask for what is not theirs.
  void Show(const std::string& tenant, uint64_t cloth);
  // One of the latest cloths of another tenant than `tenant`; 0: there is none.
  uint64_t ForeignTo(const std::string& tenant, uint32_t random) const;

 private:
  mutable std::mutex mutex_;
  std::map<std::string, std::vector<uint64_t>> shown_;
};

struct WorkerOptions {
  uint32_t worker = 1;
  uint32_t seed = 1;
  std::string address;  // of the proxy
  std::string tenant;
  std::string token;
  std::string session;
  uint64_t shared_cloth = 0;                  // 0: none
  std::vector<std::string> foreign_sessions;  // of other tenants
  bool touch_themselves = false;              // some of its cloths
  bool deletes_foreign_sessions = true;       // asks for that
  // A fault to be found: steps are repeated without their request ids.
  bool forgets_request_ids = false;
};

class Worker {
 public:
  Worker(WorkerOptions options, TrafficBoard& board);
  // Until the board says that it is over.
  void Run();
  WorkerHistory& history() { return history_; }

 private:
  // Cloths of one creation.
  struct Family {
    std::unique_ptr<RandomTraffic> traffic;
    std::vector<Mark> cloths;
    bool goes_back = false;  // is reset and loaded
  };
  struct Mine {
    uint64_t id = 0;
    uint64_t step = 0;  // as the worker counts
    size_t family = 0;
  };
  struct StateLost {};

  uint32_t Below(uint32_t count) { return static_cast<uint32_t>(random_() % count); }
  bool Chance(uint32_t one_in) { return Below(one_in) == 0; }
  std::string NextId();
  void Complain(const std::string& what);

  // Until it is answered; the first time perhaps by a session that does not wait long. Throws
  // StateLost, and every refusal.
  void Repeat(const std::function<void(Session&)>& call);
  void One();
  // Adds to the history; `call` answers. The cloths are those of the operation.
  void Do(Operation operation, const std::function<void(Operation&)>& call);
  void Create();
  void Reset();
  void Update();
  void Write();
  void Save();
  void Load();
  void Drop();
  void Delete(const std::vector<Mark>& cloths);
  // Through a snapshot: they are deleted, and come back with other ids.
  void Move(const std::vector<Mark>& cloths);
  void Read();
  void BotherOthers();
  // The cloths that came back.
  void LookAgain();

  // worker_steps.cpp
  void Step();
  void StepById(Operation operation);
  void StepUntil(Operation operation);
  void StepByStream(Operation operation);
  void StepShared();

  // worker_runs.cpp
  void LetRun();
  v1::RunRequest::Start StartOf(const Operation& operation, uint64_t step);
  // Reads the reports to the end, or to a cut. False: there was none.
  bool Watch(RunStream& run, const v1::RunRequest::Start& start, Operation& operation);
  void CheckReport(const v1::RunReport& report, const v1::RunRequest::Start& start);
  // When the run is over whatever was cut; after that nothing of it can be done any more.
  void WaitUntilOver(bool was_seen, Operation& operation);
  std::optional<StateStream> OpenViewer(Operation& operation);
  void ReadViewer(std::optional<StateStream> viewer, Operation& operation);
  void AddShown(const States& frame, Operation& operation);
  void Take(Operation& operation, const v1::StepResponse& answer);
  // Sends the request, and takes it back while it may be under way.
  void SendAndCancel(const v1::StepRequest& request);
  // `request`, as this worker sends it.
  v1::StepRequest Sent(v1::StepRequest request) const;

  Operation NewOperation(Kind kind, const std::vector<Mark>& cloths) const;
  // Some cloths of one family. There is a cloth.
  std::vector<Mark> SomeCloths(bool at_same_step = false);
  // None: those that were chosen do not.
  std::vector<Mark> SomeClothsThatGoBack();
  std::vector<uint64_t> IdsOf(const std::vector<Mark>& cloths) const;
  template <class Request>
  Request RequestFor(const std::vector<Mark>& cloths);

  const WorkerOptions options_;
  TrafficBoard& board_;
  std::mt19937 random_;
  Client client_;
  Client impatient_;  // gives up soon
  Session session_;
  Session impatient_session_;
  const std::unique_ptr<v1::SimulationService::Stub> stub_;  // for what the client library prevents
  WorkerHistory history_;
  std::vector<Family> families_;
  std::map<Mark, Mine> mine_;
  std::map<std::string, std::map<Mark, uint64_t>> saved_;  // name -> steps
  uint32_t next_number_ = 1;
  uint32_t next_id_ = 1;
};

// Whether it may have been done, or will be: to be asked again.
bool IsUncertain(const Error& error);

// With a `request_id`, of these cloths.
template <class Request>
Request Worker::RequestFor(const std::vector<Mark>& cloths) {
  Request request;
  for (const uint64_t id : IdsOf(cloths)) request.add_cloth_ids(id);
  request.set_request_id(NextId());
  return request;
}

}  // namespace drape::test
