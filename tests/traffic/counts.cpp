#include <algorithm>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "tests/traffic/checks.h"

namespace drape::test {
namespace {

std::string ClothName(const Mark& mark) {
  return "cloth " + std::to_string(mark.worker) + "." + std::to_string(mark.number);
}

const ServerRun* FindRun(const TrafficHistory& history, const std::string& incarnation) {
  const auto found = std::ranges::find(history.runs, incarnation, &ServerRun::incarnation);
  return found == history.runs.end() ? nullptr : &*found;
}

// The steps of the cloths of one worker, by what it was told.
class StepCounts {
 public:
  StepCounts(const WorkerHistory& worker, Verdict& verdict) : worker_(worker), verdict_(verdict) {}

  void Begin(const Photo& photo) {
    steps_.clear();
    saved_.clear();
    for (const auto& [mark, seen] : photo) {
      if (mark.worker == worker_.worker) steps_[mark] = seen.step;
    }
  }
  void Apply(const Operation& operation) {
    if (!operation.is_acknowledged) return;
    switch (operation.kind) {
      case Kind::kCreate:
      case Kind::kReset:
        for (const Mark& mark : operation.cloths) steps_[mark] = 0;
        return;
      case Kind::kStep:
        return ApplySteps(operation);
      case Kind::kRun:
        return ApplyRun(operation);
      case Kind::kRead:
        return ExpectSteps(operation);
      case Kind::kSave: {
        auto& saved = saved_[operation.saved_name];
        saved.clear();
        for (const Mark& mark : operation.cloths) saved[mark] = steps_[mark];
        return;
      }
      case Kind::kLoad:
        for (const Mark& mark : operation.cloths) {
          steps_[mark] = saved_[operation.saved_name][mark];
        }
        return;
      case Kind::kDelete:
        for (const Mark& mark : operation.cloths) {
          left_[mark] = steps_[mark];
          steps_.erase(mark);
        }
        return;
      case Kind::kImport:
        for (const Mark& mark : operation.cloths) steps_[mark] = left_[mark];
        return;
      case Kind::kUpdate:
      case Kind::kWrite:
      case Kind::kDrop:
        return;
    }
  }
  void ExpectEnd(const Photo& photo) {
    std::map<Mark, uint64_t> seen;
    for (const auto& [mark, cloth] : photo) {
      if (mark.worker == worker_.worker) seen[mark] = cloth.step;
    }
    if (seen == steps_) return;
    Find("at the end it has other cloths, or other steps, than it was told of");
  }

 private:
  void ApplySteps(const Operation& operation) {
    std::set<Mark> restarted;
    for (size_t k = 0; k < operation.cloths.size(); ++k) {
      const auto& ids = operation.step.resets().cloth_ids();
      if (std::ranges::count(ids, operation.step.cloth_ids(static_cast<int>(k))) > 0) {
        restarted.insert(operation.cloths[k]);
      }
    }
    for (const Mark& mark : operation.cloths) {
      if (restarted.contains(mark)) steps_[mark] = 0;
      steps_[mark] += operation.step.steps();
    }
    const size_t moving = operation.cloths.size() - operation.told_faulted.size();
    verdict_.steps_checked += moving * operation.step.steps();
    ExpectSteps(operation);
  }
  // Between what the server said that it made and what it was asked to make; exactly so many, if it
  // said that these were all.
  void ApplyRun(const Operation& operation) {
    if (operation.told_steps.size() != operation.cloths.size()) {
      return Find("a run is told of other cloths than its request");
    }
    for (size_t k = 0; k < operation.cloths.size(); ++k) {
      const Mark& mark = operation.cloths[k];
      const uint64_t before = std::exchange(steps_[mark], operation.told_steps[k]);
      const uint64_t told = operation.told_steps[k];
      const uint64_t least = before + operation.told_run_steps;
      const uint64_t most = operation.has_last_report ? least : before + operation.step.steps();
      const bool is_faulted = std::ranges::count(operation.told_faulted, mark) > 0;
      verdict_.steps_checked += told - before;
      ExpectNoGap(operation, k, before);
      if (told <= most && (told >= least || is_faulted)) continue;
      verdict_.lost_steps += told < least ? least - told : 0;
      verdict_.doubled_steps += told > most ? told - most : 0;
      Find(ClothName(mark) + " is at step " + std::to_string(told) + " after a run from " +
           std::to_string(before) + " that made at least " + std::to_string(least - before) +
           " steps and at most " + std::to_string(most - before));
    }
  }
  void ExpectNoGap(const Operation& operation, size_t cloth, uint64_t before) {
    const Mark& mark = operation.cloths[cloth];
    const auto shown = operation.shown.find(mark);
    if (shown == operation.shown.end()) return;
    uint64_t expected = before;
    for (const Shown& frame : shown->second) {
      if (frame.step != expected) {
        Find("a frame of " + ClothName(mark) + " is of step " + std::to_string(frame.step) +
             " where step " + std::to_string(expected) + " should be");
      }
      expected = frame.step + 1;
    }
    if (operation.is_shown_to_the_end && expected != operation.told_steps[cloth] + 1) {
      Find("the last frame of " + ClothName(mark) + " is of step " + std::to_string(expected - 1) +
           ", but it is at " + std::to_string(operation.told_steps[cloth]));
    }
    verdict_.frames_checked += shown->second.size();
  }
  void ExpectSteps(const Operation& operation) {
    if (operation.told_steps.size() != operation.cloths.size()) {
      return Find("an answer is about other cloths than its request");
    }
    for (size_t k = 0; k < operation.cloths.size(); ++k) {
      uint64_t& expected = steps_[operation.cloths[k]];
      const uint64_t told = operation.told_steps[k];
      const bool is_faulted = std::ranges::count(operation.told_faulted, operation.cloths[k]) > 0;
      if (is_faulted && told < expected) expected = told;
      if (told == expected) continue;
      (told < expected ? verdict_.lost_steps : verdict_.doubled_steps) +=
          std::max(told, expected) - std::min(told, expected);
      Find(ClothName(operation.cloths[k]) + " is at step " + std::to_string(told) +
           ", by the steps that were acknowledged it should be at " + std::to_string(expected));
      expected = told;
    }
  }
  void Find(const std::string& what) {
    verdict_.findings.push_back("worker " + std::to_string(worker_.worker) + ": " + what);
  }

  const WorkerHistory& worker_;
  Verdict& verdict_;
  std::map<Mark, uint64_t> steps_;
  std::map<Mark, uint64_t> left_;  // of deleted cloths
  std::map<std::string, std::map<Mark, uint64_t>> saved_;
};

void CheckWorker(const TrafficHistory& history, const WorkerHistory& worker, Verdict& verdict) {
  StepCounts counts(worker, verdict);
  for (const Epoch& epoch : worker.epochs) {
    const ServerRun* run = FindRun(history, epoch.incarnation);
    if (run == nullptr) {
      verdict.findings.push_back("a worker was told of a run of the server that never was");
      return;
    }
    counts.Begin(run->began.at(worker.session));
    for (const Operation& operation : epoch.operations) counts.Apply(operation);
  }
  // Only who acted in the last run knows all.
  const std::string& last = worker.epochs.back().incarnation;
  if (last == history.runs.back().incarnation) counts.ExpectEnd(history.ended.at(worker.session));
}

// One step at a time, by several workers: each run goes on from where it began by what was
// acknowledged, less what a kill may lose, and at most by what was open when it ended.
void CheckShared(const TrafficHistory& history, Verdict& verdict) {
  const auto step_of = [&](const std::map<std::string, Photo>& photos) {
    return photos.at(history.shared_session).at(Mark{}).step;
  };
  for (size_t k = 0; k < history.runs.size(); ++k) {
    const ServerRun& run = history.runs[k];
    const bool is_last = k + 1 == history.runs.size();
    const auto is_kept = [&](double acknowledged_s) {
      return is_last || acknowledged_s <= run.kept_until_s;
    };
    const uint64_t begin = step_of(run.began);
    const uint64_t acknowledged = run.shared_acknowledged_s.size();
    const auto kept = std::ranges::count_if(run.shared_acknowledged_s, is_kept);
    const uint64_t least = begin + static_cast<uint64_t>(kept);
    const uint64_t most = begin + acknowledged + run.shared_open;
    const uint64_t next = step_of(is_last ? history.ended : history.runs[k + 1].began);
    verdict.steps_checked += acknowledged;
    if (least <= next && next <= most) continue;
    verdict.lost_steps += next < least ? least - next : 0;
    verdict.doubled_steps += next > most ? next - most : 0;
    verdict.findings.push_back("the shared cloth went from step " + std::to_string(begin) + " to " +
                               std::to_string(next) + " by " + std::to_string(acknowledged) +
                               " acknowledged steps, of which " + std::to_string(kept) +
                               " are kept, and " + std::to_string(run.shared_open) + " open ones");
  }
}

void CheckIds(const TrafficHistory& history, Verdict& verdict) {
  std::set<uint64_t> given;
  for (const WorkerHistory& worker : history.workers) {
    for (const uint64_t id : worker.ids) {
      if (given.insert(id).second) continue;
      verdict.findings.push_back("the id " + std::to_string(id) + " was given twice");
    }
  }
}

}  // namespace

void Verdict::Add(Verdict more) {
  std::ranges::move(more.findings, std::back_inserter(findings));
  steps_checked += more.steps_checked;
  lost_steps += more.lost_steps;
  doubled_steps += more.doubled_steps;
  frames_checked += more.frames_checked;
}

Verdict CheckCounts(const TrafficHistory& history) {
  Verdict verdict;
  for (const WorkerHistory& worker : history.workers) {
    for (const std::string& complaint : worker.complaints) verdict.findings.push_back(complaint);
    CheckWorker(history, worker, verdict);
  }
  CheckShared(history, verdict);
  CheckIds(history, verdict);
  for (const ServerRun& run : history.runs) {
    for (const std::string& line : run.worries) {
      verdict.findings.push_back("the server says: " + line);
    }
  }
  for (const auto& [name, value] : history.held) {
    if (value == 0) continue;
    verdict.findings.push_back(name + " is " + std::to_string(value) + " at the end");
  }
  return verdict;
}

}  // namespace drape::test
