// What clients did and were told, and what the server held when it had started again.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "drape/v1/simulation_service.pb.h"

namespace drape::test {

// What a cloth is called over all runs of the server and in every replay: in place of its id it has
// an origin of its environment that no other cloth of the run has.
struct Mark {
  uint32_t worker = 0;  // 0: the cloth that the workers of a session share
  uint32_t number = 0;
  auto operator<=>(const Mark&) const = default;
};

// A cloth between two steps.
struct Seen {
  uint64_t step = 0;
  double time_s = 0;
  uint64_t bits = 0;  // hash of its positions and velocities
  uint64_t text = 0;  // hash of environment, settings and pins
  // A ClothSnapshot: all that it goes on from, motions, grips, sleep and counters too. Empty:
  // unseen.
  std::string whole{};
  bool operator==(const Seen&) const = default;
  bool IsLike(const Seen& other) const {
    return step == other.step && time_s == other.time_s && bits == other.bits && text == other.text;
  }
};
using Photo = std::map<Mark, Seen>;

enum class Kind {
  kCreate,
  kStep,
  kRun,
  kReset,
  kUpdate,
  kWrite,
  kSave,
  kLoad,
  kDrop,
  kDelete,
  kImport,
  kRead
};
const char* NameOf(Kind kind);

// What a viewer of every frame was shown of one cloth.
struct Shown {
  uint64_t step = 0;
  uint64_t bits = 0;
};

// A request that changed something, or would have, or looked.
struct Operation {
  Kind kind = Kind::kRead;
  // In the order of the request; ids within the messages below are those of the run.
  std::vector<Mark> cloths;
  v1::CreateClothsRequest creation;
  v1::StepRequest step;  // with `steps` as the extent; of kRun: the most that it can have made
  v1::UpdateClothsRequest update;
  v1::WriteStatesRequest writing;
  std::string saved_name;
  std::string snapshot;  // of kImport: of cloths that the worker has deleted
  // False: its client was not told, because the server ended; it may have been done, or a part of
  // its steps.
  bool is_acknowledged = false;
  double acknowledged_s = 0;           // by the clock of the test
  std::vector<uint64_t> told_steps;    // [cloths], of kStep, kRead and kRun
  std::vector<Mark> told_faulted;      // of kStep and kRun: those that stay where they are
  std::vector<uint64_t> told_bits;     // [cloths], of kRead, kRun and of kStep unless empty
  std::vector<uint64_t> told_reports;  // [cloths], of kStep unless empty
  // Of kRun: at least so many steps; exactly, if its last report came.
  uint64_t told_run_steps = 0;
  bool has_last_report = false;
  // Of kRun: the frames since before its first step, and whether all of them came.
  std::map<Mark, std::vector<Shown>> shown;
  bool is_shown_to_the_end = false;
};

// What one worker did in one run of the server.
struct Epoch {
  std::string incarnation;
  std::vector<Operation> operations;
};

struct WorkerHistory {
  uint32_t worker = 0;  // from 1
  std::string session;
  std::vector<Epoch> epochs;               // at least one
  std::vector<uint64_t> ids;               // of the cloths that it made, as it was told
  std::vector<std::string> complaints;     // answers that should not have been
  std::map<std::string, uint64_t> counts;  // of what happened, for people
};

// A run of the server from one start to the next.
struct ServerRun {
  std::string incarnation;
  // Of every session, when it had started; empty before the first cloth.
  std::map<std::string, Photo> began;
  // What was acknowledged by then must be there at the next start: until the last complete round of
  // checkpoints began, as the server said right before it was killed; to the end where it drained.
  double kept_until_s = 0;
  double ended_s = 0;                  // by the clock of the test
  std::vector<std::string> worries{};  // lines of its log about what it lost or could not keep
  // Of the cloth that several workers share, one step at a time: when they were told of each, and
  // how many were open when it ended.
  std::vector<double> shared_acknowledged_s{};
  uint64_t shared_open = 0;
};

struct TrafficHistory {
  std::vector<WorkerHistory> workers;
  std::vector<ServerRun> runs;
  std::string shared_session;
  v1::CreateClothsRequest shared_creation;
  // At the end, by session.
  std::map<std::string, Photo> ended;
  // Of /metrics, after every session was deleted: what should be zero.
  std::map<std::string, double> held;
  uint64_t operations = 0;  // acknowledged
  uint64_t cuts = 0;
  uint64_t kills = 0;
  uint64_t drains = 0;
  uint64_t repetitions = 0;
  double oldest_checkpoint_s = 0;  // at a kill
};

}  // namespace drape::test
