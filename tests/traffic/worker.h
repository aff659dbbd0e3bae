// A client that does random things, repeats what is not answered, and writes down what it is told.
#pragma once

#include <drape/client.h>

#include <atomic>
#include <functional>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "tests/system/random_traffic.h"
#include "tests/traffic/history.h"

namespace drape::test {

// Shared by the workers of a run; thread-safe.
struct TrafficBoard {
  std::atomic<bool> is_over = false;
  std::atomic<uint64_t> operations = 0;  // acknowledged
  std::atomic<uint64_t> repetitions = 0;
  std::function<double()> now_s;
  // Steps of the shared cloth: told of, or given up, in the run `incarnation`.
  std::function<void(const std::string& incarnation, bool is_acknowledged)> count_shared;
};

struct WorkerOptions {
  uint32_t worker = 1;
  uint32_t seed = 1;
  std::string address;  // of the proxy
  std::string token;
  std::string session;
  uint64_t shared_cloth = 0;                  // 0: none
  std::vector<std::string> foreign_sessions;  // of other tenants
  std::vector<uint64_t> foreign_cloths;
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

  // Until it is answered. Throws StateLost, and every refusal. Gives back how often it was sent.
  int Repeat(const std::function<void()>& call);
  void One();
  // Adds to the history; `call` answers. The cloths are those of the operation.
  void Do(Operation operation, const std::function<void(Operation&)>& call);
  void Create();
  void Step();
  void StepById(Operation operation);
  void StepUntil(Operation operation);
  void StepByStream(Operation operation);
  void Reset();
  void Update();
  void Save();
  void Load();
  void Delete();
  void Read();
  void BotherOthers();
  void StepShared();
  // The cloths that came back.
  void LookAgain();

  Operation NewOperation(Kind kind, const std::vector<Mark>& cloths) const;
  // Some cloths of a family that has any; none: there is no cloth.
  std::vector<Mark> SomeCloths(bool at_same_step = false);
  // None: those that were chosen do not.
  std::vector<Mark> SomeClothsThatGoBack();
  void Take(Operation& operation, const v1::StepResponse& answer);
  std::vector<uint64_t> IdsOf(const std::vector<Mark>& cloths) const;

  const WorkerOptions options_;
  TrafficBoard& board_;
  std::mt19937 random_;
  Client client_;
  Client impatient_;  // gives up soon
  Session session_;
  Session impatient_session_;
  WorkerHistory history_;
  std::vector<Family> families_;
  std::map<Mark, Mine> mine_;
  std::map<std::string, std::map<Mark, uint64_t>> saved_;  // name -> steps
  uint32_t next_number_ = 1;
  uint32_t next_id_ = 1;
};

}  // namespace drape::test
