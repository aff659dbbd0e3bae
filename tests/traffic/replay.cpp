#include <algorithm>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include "tests/system/server_process.h"
#include "tests/traffic/checks.h"
#include "tests/traffic/sight.h"

namespace drape::test {
namespace {

// Beyond the interval a checkpoint may be older by the time that writing takes, on a machine that
// does much else.
constexpr double kWritingTime_s = 5;
constexpr size_t kEnough = 5;  // findings of a worker

// Does again what one worker did.
class Replay {
 public:
  Replay(const TrafficHistory& history, const WorkerHistory& worker, double interval_s,
         const std::string& address)
      : history_(history),
        worker_(worker),
        interval_s_(interval_s),
        client_(Client::Connect(address)),
        session_(client_.CreateSession()) {}

  Findings Run() {
    for (size_t k = 0; k < worker_.epochs.size() && findings_.size() < kEnough; ++k) {
      RunEpoch(k);
    }
    return std::move(findings_);
  }

 private:
  // A moment at which the next run of the server may have begun.
  struct Match {
    size_t operations = 0;  // begun until then
    std::string snapshot;   // empty: there were no cloths
  };

  void Find(const std::string& what) {
    findings_.push_back("worker " + std::to_string(worker_.worker) + ": " + what);
  }
  Photo Own(const Photo& photo) const {
    Photo own;
    for (const auto& [mark, seen] : photo) {
      if (mark.worker == worker_.worker) own[mark] = seen;
    }
    return own;
  }
  std::vector<uint64_t> IdsOf(const std::vector<Mark>& cloths) const {
    std::vector<uint64_t> ids;
    for (const Mark& mark : cloths) ids.push_back(ids_.at(mark));
    return ids;
  }
  void LookAll() {
    Sight sight = Look(session_);
    now_ = std::move(sight.photo);
    ids_ = std::move(sight.ids);
  }

  void RunEpoch(size_t number) {
    const Epoch& epoch = worker_.epochs[number];
    const bool is_last = number + 1 == worker_.epochs.size();
    target_.reset();
    match_.reset();
    moments_.clear();
    const ServerRun& run = RunOf(epoch.incarnation);
    if (!is_last) {
      target_ = Own(RunOf(worker_.epochs[number + 1].incarnation).began.at(worker_.session));
    } else if (&run != &history_.runs.back()) {
      // A worker that did nothing after the last start knows nothing of it.
      target_ = Own(history_.runs.back().began.at(worker_.session));
    } else {
      target_ = Own(history_.ended.at(worker_.session));
    }
    Compare(0);
    for (size_t k = 0; k < epoch.operations.size(); ++k) {
      try {
        Apply(epoch.operations[k], k + 1);
      } catch (const Error& error) {
        if (epoch.operations[k].is_acknowledged) {
          Find(std::string("the replay is refused: ") + error.what());
        }
      }
      if (findings_.size() >= kEnough) return;
    }
    Judge(epoch, run, is_last && &run == &history_.runs.back());
    if (!is_last && match_) Restore();
  }

  const ServerRun& RunOf(const std::string& incarnation) const {
    return *std::ranges::find(history_.runs, incarnation, &ServerRun::incarnation);
  }

  // After `operations` have begun.
  void Compare(size_t operations) {
    for (const auto& [mark, seen] : now_) {
      const auto its = target_->find(mark);
      if (its != target_->end() && its->second == seen) moments_[mark].insert(operations);
    }
    if (now_ != *target_) return;
    const bool is_new = !match_;
    if (is_new) match_ = Match{.operations = operations, .snapshot = {}};
    match_->operations = operations;
    if (is_new && !now_.empty()) match_->snapshot = session_.TakeSnapshot();
  }

  void Judge(const Epoch& epoch, const ServerRun& run, bool is_end) {
    if (!match_) {
      Find("after " + std::to_string(epoch.operations.size()) +
           " operations its cloths are as they never were together" + Story(epoch));
      return;
    }
    for (size_t k = match_->operations; k < epoch.operations.size(); ++k) {
      const Operation& lost = epoch.operations[k];
      if (!lost.is_acknowledged) continue;
      const bool may_be_lost = !is_end && !run.was_drained &&
                               lost.acknowledged_s > run.ended_s - interval_s_ - kWritingTime_s;
      if (may_be_lost) return;
      Find(std::string("a ") + NameOf(lost.kind) + " that was acknowledged " +
           std::to_string(run.ended_s - lost.acknowledged_s) + " s before the end is lost (" +
           (run.was_drained ? "drained"
            : is_end        ? "at the end"
                            : "killed") +
           ")" + Story(epoch));
      return;
    }
  }

  // What the server had, and when each cloth was so: after how many operations had begun.
  std::string Story(const Epoch& epoch) const {
    std::string text = "; it did";
    for (const Operation& operation : epoch.operations) {
      text += std::string(" ") + NameOf(operation.kind);
      if (operation.kind == Kind::kStep) text += std::to_string(operation.step.steps());
      for (const Mark& mark : operation.cloths) text += "," + std::to_string(mark.number);
      if (!operation.is_acknowledged) text += "?";
    }
    for (const auto& [mark, seen] : *target_) {
      text += "; cloth " + std::to_string(mark.number) + " came back at step " +
              std::to_string(seen.step) + ", as it was after";
      const auto moments = moments_.find(mark);
      if (moments == moments_.end())
        text += " none";
      else
        for (const size_t moment : moments->second) text += " " + std::to_string(moment);
    }
    for (const auto& [mark, seen] : now_) {
      text +=
          "; cloth " + std::to_string(mark.number) + " was at step " + std::to_string(seen.step);
    }
    return text;
  }

  // The next run begins there.
  void Restore() {
    std::map<uint64_t, Mark> marks;
    for (const auto& [mark, id] : ids_) marks[id] = mark;
    if (!ids_.empty()) {
      std::vector<uint64_t> ids;
      for (const auto& [mark, id] : ids_) ids.push_back(id);
      session_.DeleteCloths(ids);
    }
    if (!match_->snapshot.empty()) (void)session_.Restore(match_->snapshot);
    LookAll();
    if (now_ != *target_) Find("a snapshot is not as the cloths were");
  }

  void Apply(const Operation& operation, size_t number) {
    switch (operation.kind) {
      case Kind::kCreate:
        (void)session_.CreateCloths(WithoutId(operation.creation));
        LookAll();
        return Compare(number);
      case Kind::kStep:
        return ApplySteps(operation, number);
      case Kind::kReset:
        session_.ResetCloths(IdsOf(operation.cloths));
        LookAll();
        return Compare(number);
      case Kind::kUpdate: {
        v1::UpdateClothsRequest update = operation.update;
        update.clear_cloth_ids();
        update.clear_request_id();
        for (const uint64_t id : IdsOf(operation.cloths)) update.add_cloth_ids(id);
        session_.UpdateCloths(std::move(update));
        LookAll();
        return Compare(number);
      }
      case Kind::kSave: {
        v1::SaveStatesRequest save;
        save.set_name(operation.saved_name);
        for (const uint64_t id : IdsOf(operation.cloths)) save.add_cloth_ids(id);
        session_.SaveStates(save);
        return Compare(number);
      }
      case Kind::kLoad: {
        v1::LoadStatesRequest load;
        load.set_name(operation.saved_name);
        for (const uint64_t id : IdsOf(operation.cloths)) load.add_cloth_ids(id);
        session_.LoadStates(load);
        LookAll();
        return Compare(number);
      }
      case Kind::kDelete:
        session_.DeleteCloths(IdsOf(operation.cloths));
        for (const Mark& mark : operation.cloths) {
          now_.erase(mark);
          ids_.erase(mark);
        }
        return Compare(number);
      case Kind::kRead:
        for (size_t k = 0; k < operation.cloths.size() && operation.is_acknowledged; ++k) {
          const Seen& seen = now_.at(operation.cloths[k]);
          if (seen.step != operation.told_steps.at(k) || seen.bits != operation.told_bits.at(k)) {
            Find("a state that was read is not that of the replay");
          }
        }
        return Compare(number);
    }
  }

  static v1::CreateClothsRequest WithoutId(v1::CreateClothsRequest creation) {
    creation.clear_request_id();
    return creation;
  }

  // Step by step: a checkpoint may be of any moment between two.
  void ApplySteps(const Operation& operation, size_t number) {
    std::map<uint64_t, uint64_t> here;  // ids of the run -> ids here
    for (size_t k = 0; k < operation.cloths.size(); ++k) {
      here[operation.step.cloth_ids(static_cast<int>(k))] = ids_.at(operation.cloths[k]);
    }
    v1::StepRequest request = operation.step;
    request.clear_request_id();
    *request.mutable_view() = WholeView();
    request.set_report(false);
    request.set_steps(1);
    const auto translate = [&](auto* ids) {
      for (uint64_t& id : *ids) id = here.at(id);
    };
    translate(request.mutable_cloth_ids());
    translate(request.mutable_pin_controls()->mutable_cloth_ids());
    translate(request.mutable_collider_controls()->mutable_cloth_ids());
    translate(request.mutable_grip_controls()->mutable_cloth_ids());
    translate(request.mutable_rest_length_controls()->mutable_cloth_ids());
    translate(request.mutable_resets()->mutable_cloth_ids());
    if (request.resets().cloth_ids_size() > 0) {
      // Before the first step, and a moment of its own.
      const auto& ids = request.resets().cloth_ids();
      session_.ResetCloths(std::vector<uint64_t>(ids.begin(), ids.end()));
      LookAll();
      Compare(number);
      request.clear_resets();
    }
    v1::StepResponse answer;
    for (uint32_t k = 0; k < operation.step.steps(); ++k) {
      const bool is_last = k + 1 == operation.step.steps();
      request.set_report(is_last && operation.step.report());
      answer = session_.Step(request);
      const std::vector<uint64_t> bits = BitsOf(answer);
      for (size_t c = 0; c < operation.cloths.size(); ++c) {
        Seen& seen = now_.at(operation.cloths[c]);
        seen.step = answer.steps(static_cast<int>(c));
        seen.time_s = answer.states().times_s(static_cast<int>(c));
        seen.bits = bits.at(c);
      }
      Compare(number);
      v1::StepRequest next;  // motions go on by themselves
      *next.mutable_cloth_ids() = request.cloth_ids();
      *next.mutable_view() = request.view();
      next.set_steps(1);
      request = std::move(next);
    }
    if (!operation.is_acknowledged) return;
    if (!operation.told_bits.empty() && operation.told_bits != BitsOf(answer)) {
      Find("the states of an answer are not those of the replay");
    }
    if (!operation.told_reports.empty() && operation.told_reports != ReportsOf(answer)) {
      Find("the reports of an answer are not those of the replay");
    }
  }

  const TrafficHistory& history_;
  const WorkerHistory& worker_;
  const double interval_s_;
  const Client client_;
  Session session_;
  Photo now_;
  std::map<Mark, uint64_t> ids_;
  std::optional<Photo> target_;
  std::optional<Match> match_;
  std::map<Mark, std::set<size_t>> moments_;  // at which each cloth was as in the target
  Findings findings_;
};

// The shared cloth has at each start, and at the end, the bits of its number of steps.
Findings ReplayShared(const TrafficHistory& history, const std::string& address) {
  Findings findings;
  const Client client = Client::Connect(address);
  Session session = client.CreateSession();
  (void)session.CreateCloths(history.shared_creation);
  std::vector<Seen> seen{Look(session).photo.at(Mark{})};
  const auto check = [&](const std::map<std::string, Photo>& photos) {
    const Seen& its = photos.at(history.shared_session).at(Mark{});
    while (seen.size() <= its.step) {
      session.Step(1);
      seen.push_back(Look(session).photo.at(Mark{}));
    }
    if (seen[its.step] == its) return;
    findings.push_back("the shared cloth has other bits than after " + std::to_string(its.step) +
                       " steps");
  };
  for (const ServerRun& run : history.runs) check(run.began);
  check(history.ended);
  return findings;
}

}  // namespace

Findings CheckReplay(const TrafficHistory& history, double checkpoint_interval_s) {
  ServerProcess server({"--backend=cpu"});
  if (!server.WaitUntilUp()) return {"no server for the replay"};
  std::mutex mutex;
  Findings findings;
  const auto add = [&](Findings more) {
    const std::lock_guard lock(mutex);
    std::ranges::move(more, std::back_inserter(findings));
  };
  const auto guarded = [&](const auto& check) {
    try {
      add(check());
    } catch (const std::exception& error) {
      add({std::string("the replay failed: ") + error.what()});
    }
  };
  std::vector<std::thread> threads;
  for (const WorkerHistory& worker : history.workers) {
    threads.emplace_back([&, &worker = worker] {
      guarded(
          [&] { return Replay(history, worker, checkpoint_interval_s, server.Address()).Run(); });
    });
  }
  threads.emplace_back([&] { guarded([&] { return ReplayShared(history, server.Address()); }); });
  for (std::thread& thread : threads) thread.join();
  return findings;
}

}  // namespace drape::test
