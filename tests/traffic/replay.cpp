#include <algorithm>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include "tests/system/random_traffic.h"
#include "tests/system/server_process.h"
#include "tests/traffic/checks.h"
#include "tests/traffic/sight.h"
#include "tests/traffic/snapshot_cloths.h"

namespace drape::test {
namespace {

constexpr size_t kEnough = 5;  // findings of a worker

// Does again what one worker did.
class Replay {
 public:
  Replay(const TrafficHistory& history, const WorkerHistory& worker, const std::string& address)
      : history_(history),
        worker_(worker),
        client_(Client::Connect(address)),
        session_(client_.CreateSession()) {}

  Verdict Run() {
    for (size_t k = 0; k < worker_.epochs.size() && verdict_.findings.size() < kEnough; ++k) {
      // What follows what cannot be explained is not judged.
      if (!RunEpoch(k)) break;
    }
    return std::move(verdict_);
  }

 private:
  // A moment at which the next run of the server may have begun.
  struct Match {
    size_t operations = 0;  // begun until then
    std::string snapshot;   // empty: there were no cloths
  };

  void Find(const std::string& what) {
    verdict_.findings.push_back("worker " + std::to_string(worker_.worker) + ": " + what);
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
    Sight sight = Glance(session_);
    now_ = std::move(sight.photo);
    ids_ = std::move(sight.ids);
  }

  // False: how the cloths were then cannot be explained.
  bool RunEpoch(size_t number) {
    const Epoch& epoch = worker_.epochs[number];
    const ServerRun& run = RunOf(epoch.incarnation);
    const bool is_last = number + 1 == worker_.epochs.size();
    // A worker that did nothing after the last start knows nothing of it.
    const bool is_end = is_last && &run == &history_.runs.back();
    const ServerRun& next =
        is_last ? history_.runs.back() : RunOf(worker_.epochs[number + 1].incarnation);
    target_ = Own((is_end ? history_.ended : next.began).at(worker_.session));
    match_.reset();
    moments_.clear();
    differs_ = {};
    Compare(0);
    for (size_t k = 0; k < epoch.operations.size(); ++k) {
      try {
        Apply(epoch.operations[k], k + 1);
      } catch (const Error& error) {
        if (epoch.operations[k].is_acknowledged) {
          Find(std::string("the replay is refused: ") + error.what());
        }
      }
      if (verdict_.findings.size() >= kEnough) return false;
    }
    if (!match_) {
      Find("after " + std::to_string(epoch.operations.size()) +
           " operations its cloths are as they never were together" + Story(epoch));
      return false;
    }
    Judge(epoch, run, is_end);
    if (!is_last) Restore();
    return true;
  }

  const ServerRun& RunOf(const std::string& incarnation) const {
    return *std::ranges::find(history_.runs, incarnation, &ServerRun::incarnation);
  }

  bool IsLikeTarget(const Mark& mark) const {
    const auto its = target_.find(mark);
    return its != target_.end() && its->second.IsLike(now_.at(mark));
  }

  // After `operations` have begun.
  void Compare(size_t operations) {
    bool is_like = now_.size() == target_.size();
    for (const auto& [mark, seen] : now_) {
      const bool is_its = IsLikeTarget(mark);
      if (is_its) moments_[mark].insert(operations);
      is_like = is_like && is_its;
    }
    if (!is_like) return;
    Sight sight = Look(session_);
    for (const auto& [mark, seen] : sight.photo) {
      if (seen == target_.at(mark)) continue;
      differs_ = "; after " + std::to_string(operations) + " cloth " + std::to_string(mark.number) +
                 " would go on differently: " + DifferenceOf(target_.at(mark).whole, seen.whole);
      return;
    }
    if (!match_) match_ = Match{.operations = operations, .snapshot = std::move(sight.snapshot)};
    match_->operations = operations;
  }

  // What came after the moment of the match was lost.
  void Judge(const Epoch& epoch, const ServerRun& run, bool is_end) {
    for (size_t k = match_->operations; k < epoch.operations.size(); ++k) {
      const Operation& lost = epoch.operations[k];
      const bool may_be_lost = !is_end && lost.acknowledged_s > run.kept_until_s;
      if (!lost.is_acknowledged || may_be_lost) continue;
      verdict_.lost_steps += uint64_t{lost.step.steps()} * lost.cloths.size();
      Find(std::string("a ") + NameOf(lost.kind) + " that was acknowledged " +
           std::to_string(run.ended_s - lost.acknowledged_s) + " s before the end is lost; by " +
           std::to_string(run.ended_s - run.kept_until_s) + " s all should be kept" + Story(epoch));
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
    for (const auto& [mark, seen] : target_) {
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
    return text + differs_;
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
    if (Look(session_).photo != target_) Find("a snapshot is not as the cloths were");
  }

  void Apply(const Operation& operation, size_t number) {
    switch (operation.kind) {
      case Kind::kCreate:
        (void)session_.CreateCloths(WithoutId(operation.creation));
        LookAll();
        return Compare(number);
      case Kind::kStep:
        return ApplySteps(operation, number);
      case Kind::kRun:
        return ApplyRun(operation, number);
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
      case Kind::kWrite: {
        v1::WriteStatesRequest writing = operation.writing;
        writing.clear_request_id();
        writing.clear_cloth_ids();
        for (const uint64_t id : IdsOf(operation.cloths)) writing.add_cloth_ids(id);
        session_.WriteStates(std::move(writing));
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
      case Kind::kLoad:
        Load(operation.saved_name, operation.cloths);
        LookAll();
        return Compare(number);
      case Kind::kDrop:
        session_.DropStates(operation.saved_name);
        return Compare(number);
      case Kind::kImport:
        (void)session_.Restore(operation.snapshot);
        LookAll();
        ExpectAsTheyWere(operation.cloths);
        return Compare(number);
      case Kind::kDelete:
        left_ = Look(session_).photo;
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

  // The run's snapshot has what this replay deleted.
  void ExpectAsTheyWere(const std::vector<Mark>& cloths) {
    const Photo now = Look(session_).photo;
    for (const Mark& mark : cloths) {
      if (now.at(mark) == left_.at(mark)) continue;
      Find("a snapshot is not as the cloths were: " +
           DifferenceOf(left_.at(mark).whole, now.at(mark).whole));
    }
  }

  static v1::CreateClothsRequest WithoutId(v1::CreateClothsRequest creation) {
    creation.clear_request_id();
    return creation;
  }

  // What a request does before its first step, to all of its cloths at one moment. Each cloth is
  // told by a request without steps.
  void BeginSteps(const Operation& operation) {
    const auto has = [](const auto& ids, uint64_t id) { return std::ranges::count(ids, id) > 0; };
    std::vector<uint64_t> restarted;
    for (size_t k = 0; k < operation.cloths.size(); ++k) {
      const uint64_t id = operation.step.cloth_ids(static_cast<int>(k));
      if (!has(operation.step.resets().cloth_ids(), id)) continue;
      restarted.push_back(ids_.at(operation.cloths[k]));
      now_.at(operation.cloths[k]).step = 0;
    }
    if (!restarted.empty()) session_.ResetCloths(restarted);
    for (size_t k = 0; k < operation.cloths.size(); ++k) {
      const Mark& mark = operation.cloths[k];
      v1::StepRequest request = RandomTraffic::OnlyFor(
          operation.step, operation.step.cloth_ids(static_cast<int>(k)), ids_.at(mark));
      request.clear_request_id();
      request.clear_resets();
      request.clear_view();
      request.clear_report();
      request.clear_grip_states();
      request.set_until_step(now_.at(mark).step);
      session_.Step(request);
    }
    if (!restarted.empty()) LookAll();
  }

  // Step by step: a checkpoint may be of any moment between two.
  void ApplySteps(const Operation& operation, size_t number) {
    BeginSteps(operation);
    std::set<Mark> held;
    Hold(operation, held);
    v1::StepRequest request;
    for (const uint64_t id : IdsOf(operation.cloths)) request.add_cloth_ids(id);
    *request.mutable_view() = WholeView();
    request.set_steps(1);
    v1::StepResponse answer;
    for (uint32_t k = 1; k <= operation.step.steps(); ++k) {
      request.set_report(k == operation.step.steps() && operation.step.report());
      answer = session_.Step(request);
      const std::vector<uint64_t> bits = BitsOf(answer);
      for (size_t c = 0; c < operation.cloths.size(); ++c) {
        Seen& seen = now_.at(operation.cloths[c]);
        seen.step = answer.steps(static_cast<int>(c));
        seen.time_s = answer.states().times_s(static_cast<int>(c));
        seen.bits = bits.at(c);
      }
      Hold(operation, held);
    }
    CompareHeld(operation, held, number);
    if (!operation.is_acknowledged) return;
    if (!operation.told_bits.empty() && operation.told_bits != BitsOf(answer)) {
      Find("the states of an answer are not those of the replay");
    }
    if (!operation.told_reports.empty() && operation.told_reports != ReportsOf(answer)) {
      Find("the reports of an answer are not those of the replay");
    }
  }

  // Each cloth up to where its client found it. A client that was not told may have run for any
  // number of steps.
  void ApplyRun(const Operation& operation, size_t number) {
    std::set<Mark> held;
    Hold(operation, held);
    for (uint32_t k = 1; k <= operation.step.steps(); ++k) {
      v1::StepRequest request;
      std::vector<Mark> moving;
      for (size_t c = 0; c < operation.cloths.size(); ++c) {
        const Mark& mark = operation.cloths[c];
        CompareShown(operation, mark);
        if (operation.is_acknowledged && now_.at(mark).step >= operation.told_steps.at(c)) continue;
        moving.push_back(mark);
        request.add_cloth_ids(ids_.at(mark));
      }
      if (moving.empty()) break;
      request.set_steps(1);
      *request.mutable_view() = WholeView();
      const v1::StepResponse answer = session_.Step(request);
      const std::vector<uint64_t> bits = BitsOf(answer);
      for (size_t c = 0; c < moving.size(); ++c) {
        Seen& seen = now_.at(moving[c]);
        seen.step = answer.steps(static_cast<int>(c));
        seen.time_s = answer.states().times_s(static_cast<int>(c));
        seen.bits = bits.at(c);
      }
      Hold(operation, held);
    }
    for (size_t c = 0; operation.is_acknowledged && c < operation.cloths.size(); ++c) {
      CompareShown(operation, operation.cloths[c]);
      if (now_.at(operation.cloths[c]).bits == operation.told_bits.at(c)) continue;
      Find("a run ended in another state than the replay");
    }
    CompareHeld(operation, held, number);
  }
  // The frame of the present step, if one was shown.
  void CompareShown(const Operation& operation, const Mark& mark) {
    const auto shown = operation.shown.find(mark);
    if (shown == operation.shown.end()) return;
    for (const Shown& frame : shown->second) {
      if (frame.step != now_.at(mark).step || frame.bits == now_.at(mark).bits) continue;
      Find("a frame is not the state of the replay");
    }
  }

  // A request steps each of its cloths when its turn comes: a checkpoint has some of them further
  // than others. Those that now are as in the target are kept for CompareHeld.
  void Hold(const Operation& operation, std::set<Mark>& held) {
    for (const Mark& mark : operation.cloths) {
      if (!IsLikeTarget(mark)) continue;
      // A cloth that faults looks afterwards as it did before: its whole tells.
      const bool is_first = held.insert(mark).second;
      if (!is_first && Look(session_).photo.at(mark) != target_.at(mark)) continue;
      v1::SaveStatesRequest save;
      save.set_name(HeldName(mark));
      save.add_cloth_ids(ids_.at(mark));
      session_.SaveStates(save);
    }
  }

  // The moment at which each cloth of the request is as it was held, if there is one.
  void CompareHeld(const Operation& operation, const std::set<Mark>& held, size_t number) {
    if (held.size() < operation.cloths.size()) {
      for (const Mark& mark : held) moments_[mark].insert(number);
      return;
    }
    const std::string ends = "ends";
    v1::SaveStatesRequest save;
    save.set_name(ends);
    for (const uint64_t id : IdsOf(operation.cloths)) save.add_cloth_ids(id);
    session_.SaveStates(save);
    for (const Mark& mark : operation.cloths) Load(HeldName(mark), {mark});
    LookAll();
    Compare(number);
    Load(ends, operation.cloths);
    LookAll();
  }

  static std::string HeldName(const Mark& mark) { return "held " + std::to_string(mark.number); }
  void Load(const std::string& name, const std::vector<Mark>& cloths) {
    v1::LoadStatesRequest load;
    load.set_name(name);
    for (const uint64_t id : IdsOf(cloths)) load.add_cloth_ids(id);
    session_.LoadStates(load);
  }

  const TrafficHistory& history_;
  const WorkerHistory& worker_;
  const Client client_;
  Session session_;
  Photo now_;  // without Seen::whole
  std::map<Mark, uint64_t> ids_;
  Photo left_;  // before the last deletion
  Photo target_;
  std::optional<Match> match_;
  std::map<Mark, std::set<size_t>> moments_;  // at which each cloth was as in the target
  std::string differs_;                       // where it looked so, but was not
  Verdict verdict_;
};

// The shared cloth has at each start, and at the end, the bits of its number of steps.
Verdict ReplayShared(const TrafficHistory& history, const std::string& address) {
  Verdict verdict;
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
    verdict.findings.push_back("the shared cloth has other bits than after " +
                               std::to_string(its.step) + " steps");
  };
  for (const ServerRun& run : history.runs) check(run.began);
  check(history.ended);
  return verdict;
}

}  // namespace

Verdict CheckReplay(const TrafficHistory& history) {
  ServerProcess server({"--backend=cpu"});
  if (!server.WaitUntilUp()) return {.findings = {"no server for the replay"}};
  std::mutex mutex;
  Verdict verdict;
  const auto guarded = [&](const auto& check) {
    Verdict its;
    try {
      its = check();
    } catch (const std::exception& error) {
      its.findings = {std::string("the replay failed: ") + error.what()};
    }
    const std::lock_guard lock(mutex);
    verdict.Add(std::move(its));
  };
  std::vector<std::thread> threads;
  for (const WorkerHistory& worker : history.workers) {
    threads.emplace_back([&, &worker = worker] {
      guarded([&] { return Replay(history, worker, server.Address()).Run(); });
    });
  }
  threads.emplace_back([&] { guarded([&] { return ReplayShared(history, server.Address()); }); });
  for (std::thread& thread : threads) thread.join();
  return verdict;
}

}  // namespace drape::test
