#include "tests/traffic/worker.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>
#include <utility>

#include "tests/api/requests.h"
#include "tests/traffic/sight.h"

namespace drape::test {
namespace {

constexpr size_t kMaxCloths = 6;
constexpr double kAnswerIn_s = 60;
// About what a request takes: some are given up before they are done, some after.
constexpr double kImpatience_s = 0.004;
constexpr int kMaxSendings = 20'000;

ConnectOptions Options(const std::string& token, double timeout_s) {
  ConnectOptions options;
  options.ready_timeout_s = kAnswerIn_s;
  options.request_timeout_s = timeout_s;
  options.token = token;
  return options;
}

bool IsUncertain(const Error& error) {
  switch (error.code()) {
    case ErrorCode::kUnavailable:
    case ErrorCode::kDeadlineExceeded:
    case ErrorCode::kCancelled:
    case ErrorCode::kUnknown:
    case ErrorCode::kInternal:
      return true;
    default:
      return error.reason() == "REQUEST_IN_PROGRESS" || error.details().retry_after.has_value();
  }
}

// AttachSession of a connection that may be cut.
template <class Call>
auto Persist(const Call& call) {
  for (int k = 0;; ++k) {
    try {
      return call();
    } catch (const Error& error) {
      if (!IsUncertain(error) || k > kMaxSendings) throw;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
}

}  // namespace

Worker::Worker(WorkerOptions options, TrafficBoard& board)
    : options_(std::move(options)),
      board_(board),
      random_(options_.seed),
      client_(Persist(
          [&] { return Client::Connect(options_.address, Options(options_.token, kAnswerIn_s)); })),
      impatient_(Persist([&] {
        return Client::Connect(options_.address, Options(options_.token, kImpatience_s));
      })),
      session_(Persist([&] { return client_.AttachSession(options_.session); })),
      impatient_session_(Persist([&] { return impatient_.AttachSession(options_.session); })) {
  history_.worker = options_.worker;
  history_.session = options_.session;
  const v1::Session now = Persist([&] { return session_.Renew(); });
  history_.epochs.push_back({now.incarnation(), {}});
}

std::string Worker::NextId() {
  return std::to_string(options_.worker) + "/" + std::to_string(next_id_++);
}

void Worker::Complain(const std::string& what) {
  history_.complaints.push_back("worker " + std::to_string(options_.worker) + ": " + what);
}

int Worker::Repeat(const std::function<void()>& call) {
  for (int sent = 1;; ++sent) {
    try {
      call();
      return sent;
    } catch (const Error& error) {
      if (error.reason() == "STATE_LOST") throw StateLost();
      if (!IsUncertain(error) || sent > kMaxSendings) throw;
      ++board_.repetitions;
      std::this_thread::sleep_for(std::chrono::milliseconds(1 + Below(4)));
    }
  }
}

void Worker::Run() {
  while (!board_.is_over) {
    try {
      One();
    } catch (const StateLost&) {
      LookAgain();
    } catch (const Error& error) {
      Complain(std::string("refused: ") + error.what());
      if (history_.complaints.size() > 20) return;
    }
  }
}

void Worker::One() {
  if (mine_.empty()) return Create();
  const uint32_t dice = Below(100);
  if (dice < 6) return mine_.size() < kMaxCloths ? Create() : Delete();
  if (dice < 60) return Step();
  if (dice < 68) return Read();
  if (dice < 73) return Reset();
  if (dice < 79) return Update();
  if (dice < 84) return Save();
  if (dice < 89) return Load();
  if (dice < 91) return Delete();
  if (dice < 95) return BotherOthers();
  return options_.shared_cloth != 0 ? StepShared() : Step();
}

Operation Worker::NewOperation(Kind kind, const std::vector<Mark>& cloths) const {
  Operation operation;
  operation.kind = kind;
  operation.cloths = cloths;
  return operation;
}

void Worker::Do(Operation operation, const std::function<void(Operation&)>& call) {
  ++history_.counts[NameOf(operation.kind)];
  auto& operations = history_.epochs.back().operations;
  operations.push_back(std::move(operation));
  call(operations.back());
  operations.back().is_acknowledged = true;
  operations.back().acknowledged_s = board_.now_s();
  ++board_.operations;
}

std::vector<uint64_t> Worker::IdsOf(const std::vector<Mark>& cloths) const {
  std::vector<uint64_t> ids;
  for (const Mark& mark : cloths) ids.push_back(mine_.at(mark).id);
  return ids;
}

std::vector<Mark> Worker::SomeClothsThatGoBack() {
  const std::vector<Mark> cloths = SomeCloths();
  return families_[mine_.at(cloths[0]).family].goes_back ? cloths : std::vector<Mark>();
}

std::vector<Mark> Worker::SomeCloths(bool at_same_step) {
  std::vector<Mark> all;
  for (const auto& [mark, cloth] : mine_) all.push_back(mark);
  const Mark& first = all[Below(static_cast<uint32_t>(all.size()))];
  const Mine& like = mine_.at(first);
  std::vector<Mark> some{first};
  for (const Mark& mark : all) {
    const Mine& cloth = mine_.at(mark);
    if (mark == first || cloth.family != like.family || Chance(3)) continue;
    if (at_same_step && cloth.step != like.step) continue;
    some.push_back(mark);
  }
  return some;
}

void Worker::Create() {
  Family family;
  // Kinds by turns: springs, bending, colliders, self-collision, grips, sleep, chains, meshes.
  family.goes_back = Chance(2);
  family.traffic = std::make_unique<RandomTraffic>(static_cast<uint32_t>(random_()), true);
  v1::CreateClothsRequest creation = family.traffic->Creation(options_.session);
  const uint32_t count = 1 + Below(2);
  creation.set_count(count);
  creation.mutable_overrides()->DeleteSubrange(static_cast<int>(count),
                                               creation.overrides_size() - static_cast<int>(count));
  for (uint32_t k = 0; k < count; ++k) family.cloths.push_back({options_.worker, next_number_++});
  for (const Mark& mark : family.cloths) {
    SetOrigin(mark, creation.mutable_environment_origins_m());
  }
  creation.set_request_id(NextId());
  Operation operation = NewOperation(Kind::kCreate, family.cloths);
  operation.creation = creation;
  families_.push_back(std::move(family));
  Do(std::move(operation), [&](Operation& done) {
    v1::CreateClothsResponse answer;
    Repeat([&] { answer = session_.CreateCloths(creation); });
    for (size_t k = 0; k < done.cloths.size(); ++k) {
      const uint64_t id = answer.cloth_ids(static_cast<int>(k));
      mine_[done.cloths[k]] = {id, 0, families_.size() - 1};
    }
  });
}

void Worker::Step() {
  const uint32_t dice = Below(10);
  const std::vector<Mark> cloths = SomeCloths(dice < 4);
  const Family& family = families_[mine_.at(cloths[0]).family];
  const bool counts = dice < 4 && !family.goes_back;
  Operation operation = NewOperation(Kind::kStep, cloths);
  operation.step = family.traffic->Steps(options_.session, IdsOf(cloths));
  operation.step.set_steps(1 + Below(3));
  if (!Chance(3)) operation.step.set_report(false);
  if (Chance(2)) operation.step.clear_view();
  if (counts) return StepUntil(std::move(operation));
  if (dice < 6) return StepByStream(std::move(operation));
  if (family.goes_back && Chance(6)) {
    // Some of them from the start, in the same request.
    operation.step.mutable_resets()->add_cloth_ids(mine_.at(cloths[0]).id);
  }
  StepById(std::move(operation));
}

void Worker::Take(Operation& operation, const v1::StepResponse& answer) {
  operation.told_steps.assign(answer.steps().begin(), answer.steps().end());
  for (size_t k = 0; k < operation.cloths.size(); ++k) {
    const uint64_t id = answer.cloth_ids(static_cast<int>(k));
    if (std::ranges::count(answer.faulted_cloth_ids(), id) > 0) {
      operation.told_faulted.push_back(operation.cloths[k]);
    }
  }
  operation.told_bits = BitsOf(answer);
  operation.told_reports = ReportsOf(answer);
  for (size_t k = 0; k < operation.cloths.size(); ++k) {
    mine_.at(operation.cloths[k]).step = answer.steps(static_cast<int>(k));
  }
}

void Worker::StepById(Operation operation) {
  const bool is_impatient = Chance(4);
  operation.step.set_request_id(NextId());
  Do(std::move(operation), [&](Operation& done) {
    v1::StepResponse answer;
    bool is_first = true;
    Repeat([&] {
      v1::StepRequest request = done.step;
      if (options_.forgets_request_ids) request.clear_request_id();
      Session& session = is_impatient && is_first ? impatient_session_ : session_;
      is_first = false;
      answer = session.Step(std::move(request));
    });
    Take(done, answer);
  });
}

// Without an id: it counts. What was done before a cut is seen by the step where cloths are, and
// controls go on by themselves. Only for cloths that never go back to a step: a sending that
// arrives late would be done there again.
void Worker::StepUntil(Operation operation) {
  const uint64_t before = mine_.at(operation.cloths[0]).step;
  const uint64_t after = before + operation.step.steps();
  Do(std::move(operation), [&](Operation& done) {
    v1::StepRequest request = done.step;
    request.set_until_step(after);
    request.set_expected_step(before);
    v1::StepResponse answer;
    int sent = 0;
    bool has_begun = false;
    Repeat([&] {
      ++sent;
      try {
        answer = session_.Step(request);
      } catch (const Error& error) {
        if (error.reason() != "STEP_MISMATCH") throw;
        if (sent == 1) Complain("a cloth was not where it had been: " + std::string(error.what()));
        has_begun = true;
      }
    });
    if (has_begun) {
      v1::StepRequest rest;
      *rest.mutable_cloth_ids() = request.cloth_ids();
      rest.set_until_step(after);
      if (request.has_view()) *rest.mutable_view() = request.view();
      Repeat([&] { answer = session_.Step(rest); });
    }
    Take(done, answer);
    // Measured after a step of its own, or not at all.
    if (has_begun) done.told_reports.clear();
  });
}

// Several requests on one stream. After a cut another stream takes those without an answer, one at
// a time: the first may still be under way there, and those behind it would overtake it.
void Worker::StepByStream(Operation operation) {
  const uint32_t count = 2 + Below(2);
  auto& operations = history_.epochs.back().operations;
  const size_t first = operations.size();
  for (uint32_t k = 0; k < count; ++k) {
    Operation next = operation;
    next.step.set_request_id(NextId());
    if (k > 0) {
      next.step.clear_pin_controls();
      next.step.clear_collider_controls();
      next.step.clear_grip_controls();
      next.step.clear_rest_length_controls();
    }
    operations.push_back(std::move(next));
  }
  history_.counts["stream"] += 1;
  size_t next = first;
  bool is_repeated = false;
  Repeat([&] {
    StepStream stream = session_.OpenStepStream();
    const auto write = [&](size_t k) {
      v1::StepRequest request = operations[k].step;
      if (options_.forgets_request_ids) request.clear_request_id();
      try {
        stream.Write(std::move(request));
      } catch (const Error&) {
        // Read tells why.
      }
    };
    const bool is_first = !std::exchange(is_repeated, true);
    for (size_t k = next; is_first && k < first + count; ++k) write(k);
    while (next < first + count) {
      if (!is_first) write(next);
      const auto answer = stream.Read();
      if (!answer) return Complain("a stream ended before its answers");
      Take(operations[next], *answer);
      operations[next].is_acknowledged = true;
      operations[next].acknowledged_s = board_.now_s();
      ++board_.operations;
      ++next;
    }
  });
}

void Worker::Reset() {
  const std::vector<Mark> cloths = SomeClothsThatGoBack();
  if (cloths.empty()) return Read();
  Do(NewOperation(Kind::kReset, cloths), [&](Operation& done) {
    v1::ResetClothsRequest request;
    for (const uint64_t id : IdsOf(done.cloths)) request.add_cloth_ids(id);
    request.set_request_id(NextId());
    Repeat([&] { session_.ResetCloths(request); });
    for (const Mark& mark : done.cloths) mine_.at(mark).step = 0;
  });
}

void Worker::Update() {
  Operation operation = NewOperation(Kind::kUpdate, SomeCloths());
  v1::UpdateClothsRequest& update = operation.update;
  update.set_request_id(NextId());
  for (const uint64_t id : IdsOf(operation.cloths)) update.add_cloth_ids(id);
  v1::ClothSpec& spec = *update.mutable_spec();
  // Another gravity each time: so every update is seen in what GetCloth tells.
  const double x = 1e-5 * next_id_++ + 1e-9 * options_.worker;
  Set(spec.mutable_environment()->mutable_gravity_m_per_s2(), {x, -9, 0.5});
  update.mutable_update_mask()->add_paths("environment.gravity_m_per_s2");
  if (Chance(2)) {
    spec.mutable_material()->set_damping_per_s(0.01 * Below(50));
    update.mutable_update_mask()->add_paths("material.damping_per_s");
  }
  if (Chance(3)) {
    spec.mutable_settings()->set_time_step_s(Chance(2) ? 0.01 : 1.0 / 60);
    spec.mutable_settings()->set_substeps(2 + Below(6));
    update.mutable_update_mask()->add_paths("settings");
  }
  Do(std::move(operation),
     [&](Operation& done) { Repeat([&] { session_.UpdateCloths(done.update); }); });
}

void Worker::Save() {
  const std::vector<Mark> cloths = SomeClothsThatGoBack();
  if (cloths.empty()) return Read();
  Operation operation = NewOperation(Kind::kSave, cloths);
  operation.saved_name = std::to_string(options_.worker) + (Chance(2) ? "a" : "b");
  Do(std::move(operation), [&](Operation& done) {
    v1::SaveStatesRequest request;
    request.set_request_id(NextId());
    request.set_name(done.saved_name);
    for (const uint64_t id : IdsOf(done.cloths)) request.add_cloth_ids(id);
    Repeat([&] { session_.SaveStates(request); });
    auto& saved = saved_[done.saved_name];
    saved.clear();
    for (const Mark& mark : done.cloths) saved[mark] = mine_.at(mark).step;
  });
}

void Worker::Load() {
  if (saved_.empty()) return Save();
  auto entry = saved_.begin();
  if (saved_.size() > 1 && Chance(2)) ++entry;
  std::vector<Mark> cloths;
  for (const auto& [mark, step] : entry->second) {
    if (mine_.contains(mark)) cloths.push_back(mark);
  }
  if (cloths.empty()) return Save();
  Operation operation = NewOperation(Kind::kLoad, cloths);
  operation.saved_name = entry->first;
  Do(std::move(operation), [&](Operation& done) {
    v1::LoadStatesRequest request;
    request.set_request_id(NextId());
    request.set_name(done.saved_name);
    for (const uint64_t id : IdsOf(done.cloths)) request.add_cloth_ids(id);
    Repeat([&] { session_.LoadStates(request); });
    for (const Mark& mark : done.cloths) mine_.at(mark).step = entry->second.at(mark);
  });
}

void Worker::Delete() {
  Do(NewOperation(Kind::kDelete, SomeCloths()), [&](Operation& done) {
    v1::DeleteClothsRequest request;
    for (const uint64_t id : IdsOf(done.cloths)) request.add_cloth_ids(id);
    request.set_request_id(NextId());
    Repeat([&] { session_.DeleteCloths(request); });
    for (const Mark& mark : done.cloths) mine_.erase(mark);
  });
}

void Worker::Read() {
  Do(NewOperation(Kind::kRead, SomeCloths()), [&](Operation& done) {
    const std::vector<uint64_t> ids = IdsOf(done.cloths);
    Repeat([&] {
      done.told_steps.clear();
      done.told_bits.clear();
      for (const ClothState& state : session_.ReadStates(ids, WholeView())) {
        done.told_steps.push_back(state.step);
        done.told_bits.push_back(BitsOf(state));
      }
    });
  });
}

// Names and ids of others are those of nobody.
void Worker::BotherOthers() {
  ++history_.counts["foreign"];
  const auto expect = [&](const std::string& reason, const std::function<void()>& call) {
    Repeat([&] {
      try {
        call();
        Complain("something of another tenant answered");
      } catch (const Error& error) {
        if (error.reason() == "STATE_LOST" || IsUncertain(error)) throw;
        if (error.reason() != reason) Complain(std::string("of another tenant: ") + error.what());
      }
    });
    ++board_.operations;
  };
  const auto any = [&](const auto& list) -> const auto& {
    return list[Below(static_cast<uint32_t>(list.size()))];
  };
  if (Chance(2) && !options_.foreign_sessions.empty()) {
    const std::string& name = any(options_.foreign_sessions);
    expect("SESSION_NOT_FOUND", [&] { (void)client_.AttachSession(name); });
  } else if (!options_.foreign_cloths.empty()) {
    const uint64_t id = any(options_.foreign_cloths);
    expect("CLOTH_NOT_FOUND", [&] { (void)session_.GetCloth(id); });
    v1::StepRequest request;
    request.add_cloth_ids(id);
    request.set_steps(1);
    expect("CLOTH_NOT_FOUND", [&] { (void)session_.Step(request); });
  }
}

void Worker::StepShared() {
  const std::string incarnation = history_.epochs.back().incarnation;
  v1::StepRequest request;
  request.add_cloth_ids(options_.shared_cloth);
  request.set_steps(1);
  request.set_request_id(NextId());
  try {
    Repeat([&] {
      v1::StepRequest again = request;
      if (options_.forgets_request_ids) again.clear_request_id();
      (void)session_.Step(std::move(again));
    });
  } catch (const StateLost&) {
    board_.count_shared(incarnation, false);
    throw;
  }
  board_.count_shared(incarnation, true);
  ++board_.operations;
}

void Worker::LookAgain() {
  ++history_.counts["state_lost"];
  saved_.clear();
  for (;;) {
    try {
      v1::Session now;
      Repeat([&] { now = session_.Reattach(); });
      Repeat([&] { (void)impatient_session_.Reattach(); });
      std::vector<v1::Cloth> cloths;
      Repeat([&] { cloths = session_.ListCloths(); });
      history_.epochs.push_back({now.incarnation(), {}});
      const std::map<Mark, Mine> before = std::exchange(mine_, {});
      for (const v1::Cloth& cloth : cloths) {
        const Mark mark = MarkOf(cloth);
        if (mark.worker != options_.worker) continue;
        const auto family = std::ranges::find_if(families_, [&](const Family& made) {
          return std::ranges::find(made.cloths, mark) != made.cloths.end();
        });
        if (family == families_.end()) return Complain("it has a cloth that it never made");
        mine_[mark] = {cloth.id(), cloth.step(), static_cast<size_t>(family - families_.begin())};
      }
      return;
    } catch (const StateLost&) {
      // And again.
    }
  }
}

}  // namespace drape::test
