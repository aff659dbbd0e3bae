#include "tests/traffic/worker.h"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "tests/api/requests.h"
#include "tests/system/calls.h"
#include "tests/traffic/sight.h"

namespace drape::test {
namespace {

constexpr size_t kMaxCloths = 6;
constexpr double kAnswerIn_s = 60;
// About what a request takes: some are given up before they are done, some after.
constexpr double kImpatience_s = 0.004;
constexpr int kMaxSendings = 20'000;
constexpr size_t kMaxShown = 16;  // cloths of a tenant

ConnectOptions Options(const std::string& token, double timeout_s) {
  ConnectOptions options;
  options.ready_timeout_s = kAnswerIn_s;
  options.request_timeout_s = timeout_s;
  options.token = token;
  return options;
}

void Pack(const std::vector<float>& numbers, v1::PackedArray* array) {
  array->set_data_type(v1::PackedArray::FLOAT32);
  array->add_shape(static_cast<uint32_t>(numbers.size() / 3));
  array->add_shape(3);
  array->set_data(numbers.data(), numbers.size() * sizeof(float));
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

void TrafficBoard::Show(const std::string& tenant, uint64_t cloth) {
  const std::lock_guard lock(mutex_);
  std::vector<uint64_t>& cloths = shown_[tenant];
  cloths.push_back(cloth);
  if (cloths.size() > kMaxShown) cloths.erase(cloths.begin());
}

uint64_t TrafficBoard::ForeignTo(const std::string& tenant, uint32_t random) const {
  const std::lock_guard lock(mutex_);
  std::vector<uint64_t> foreign;
  for (const auto& [owner, cloths] : shown_) {
    if (owner != tenant) foreign.insert(foreign.end(), cloths.begin(), cloths.end());
  }
  return foreign.empty() ? 0 : foreign[random % foreign.size()];
}

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
      impatient_session_(Persist([&] { return impatient_.AttachSession(options_.session); })),
      stub_(v1::SimulationService::NewStub(
          grpc::CreateChannel(options_.address, grpc::InsecureChannelCredentials()))) {
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

void Worker::Repeat(const std::function<void(Session&)>& call) {
  const bool is_impatient = Chance(5);
  for (int sent = 1;; ++sent) {
    try {
      return call(is_impatient && sent == 1 ? impatient_session_ : session_);
    } catch (const Error& error) {
      if (error.reason() == "STATE_LOST") throw StateLost();
      if (!IsUncertain(error) || sent > kMaxSendings) throw;
      ++board_.repetitions;
      const uint32_t most_ms = 4u << std::min(sent, 4);
      std::this_thread::sleep_for(std::chrono::milliseconds(1 + Below(most_ms)));
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
  if (dice < 6) return mine_.size() < kMaxCloths ? Create() : Delete(SomeCloths());
  if (dice < 52) return Step();
  if (dice < 60) return LetRun();
  if (dice < 68) return Read();
  if (dice < 73) return Reset();
  if (dice < 77) return Update();
  if (dice < 79) return Write();
  if (dice < 84) return Save();
  if (dice < 88) return Load();
  if (dice < 89) return Drop();
  if (dice < 90) return Delete(SomeCloths());
  if (dice < 91) return Move(SomeCloths());
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
  const auto seed = static_cast<uint32_t>(random_());
  family.traffic = std::make_unique<RandomTraffic>(seed, options_.touch_themselves && Chance(4));
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
    Repeat([&](Session& session) { answer = session.CreateCloths(creation); });
    for (size_t k = 0; k < done.cloths.size(); ++k) {
      const uint64_t id = answer.cloth_ids(static_cast<int>(k));
      history_.ids.push_back(id);
      board_.Show(options_.tenant, id);
      mine_[done.cloths[k]] = {id, 0, families_.size() - 1};
    }
  });
}

void Worker::Reset() {
  const std::vector<Mark> cloths = SomeClothsThatGoBack();
  if (cloths.empty()) return Read();
  Do(NewOperation(Kind::kReset, cloths), [&](Operation& done) {
    const auto request = RequestFor<v1::ResetClothsRequest>(done.cloths);
    Repeat([&](Session& session) { session.ResetCloths(request); });
    for (const Mark& mark : done.cloths) mine_.at(mark).step = 0;
  });
}

void Worker::Update() {
  Operation operation = NewOperation(Kind::kUpdate, SomeCloths());
  operation.update = RequestFor<v1::UpdateClothsRequest>(operation.cloths);
  v1::UpdateClothsRequest& update = operation.update;
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
  Do(std::move(operation), [&](Operation& done) {
    Repeat([&](Session& session) { session.UpdateCloths(done.update); });
  });
}

// The states that they have, thrown back.
void Worker::Write() {
  Operation operation = NewOperation(Kind::kWrite, SomeCloths());
  operation.writing = RequestFor<v1::WriteStatesRequest>(operation.cloths);
  v1::WriteStatesRequest& writing = operation.writing;
  const std::vector<uint64_t> ids = IdsOf(operation.cloths);
  Repeat([&](Session& session) {
    writing.clear_positions_m();
    std::vector<float> positions_m, velocities_m_per_s;
    for (const ClothState& state : session.ReadStates(ids, WholeView())) {
      const auto place = state.positions_m.floats();
      positions_m.insert(positions_m.end(), place.begin(), place.end());
      for (const float velocity : state.velocities_m_per_s.floats()) {
        velocities_m_per_s.push_back(-0.5f * velocity);
      }
    }
    Pack(positions_m, writing.mutable_positions_m());
    Pack(velocities_m_per_s, writing.mutable_velocities_m_per_s());
  });
  Do(std::move(operation), [&](Operation& done) {
    Repeat([&](Session& session) { session.WriteStates(done.writing); });
  });
}

void Worker::Save() {
  const std::vector<Mark> cloths = SomeClothsThatGoBack();
  if (cloths.empty()) return Read();
  Operation operation = NewOperation(Kind::kSave, cloths);
  operation.saved_name = std::to_string(options_.worker) + (Chance(2) ? "a" : "b");
  Do(std::move(operation), [&](Operation& done) {
    auto request = RequestFor<v1::SaveStatesRequest>(done.cloths);
    request.set_name(done.saved_name);
    Repeat([&](Session& session) { session.SaveStates(request); });
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
    auto request = RequestFor<v1::LoadStatesRequest>(done.cloths);
    request.set_name(done.saved_name);
    Repeat([&](Session& session) { session.LoadStates(request); });
    for (const Mark& mark : done.cloths) mine_.at(mark).step = entry->second.at(mark);
  });
}

void Worker::Drop() {
  if (saved_.empty()) return Save();
  Operation operation = NewOperation(Kind::kDrop, {});
  operation.saved_name = saved_.begin()->first;
  Do(std::move(operation), [&](Operation& done) {
    v1::DropStatesRequest request;
    request.set_request_id(NextId());
    request.set_name(done.saved_name);
    Repeat([&](Session& session) { session.DropStates(request); });
    saved_.erase(done.saved_name);
  });
}

void Worker::Delete(const std::vector<Mark>& cloths) {
  Do(NewOperation(Kind::kDelete, cloths), [&](Operation& done) {
    const auto request = RequestFor<v1::DeleteClothsRequest>(done.cloths);
    Repeat([&](Session& session) { session.DeleteCloths(request); });
    for (const Mark& mark : done.cloths) mine_.erase(mark);
  });
}

void Worker::Move(const std::vector<Mark>& cloths) {
  Operation operation = NewOperation(Kind::kImport, cloths);
  const std::vector<uint64_t> ids = IdsOf(cloths);
  Repeat([&](Session& session) { operation.snapshot = session.TakeSnapshot(ids); });
  std::map<uint64_t, std::pair<Mark, Mine>> former;
  for (const Mark& mark : cloths) former[mine_.at(mark).id] = {mark, mine_.at(mark)};
  Delete(cloths);
  // What was saved belongs to the ids that they had.
  for (auto& [name, saved] : saved_) {
    for (const Mark& mark : cloths) saved.erase(mark);
  }
  const std::string request_id = NextId();
  Do(std::move(operation), [&](Operation& done) {
    RestoredCloths restored;
    Repeat([&](Session& session) { restored = session.Restore(done.snapshot, false, request_id); });
    for (size_t k = 0; k < restored.cloths.size(); ++k) {
      const auto& [mark, mine] = former.at(restored.former_cloths[k]);
      mine_[mark] = {restored.cloths[k], mine.step, mine.family};
      history_.ids.push_back(restored.cloths[k]);
      board_.Show(options_.tenant, restored.cloths[k]);
    }
  });
}

void Worker::Read() {
  Do(NewOperation(Kind::kRead, SomeCloths()), [&](Operation& done) {
    const std::vector<uint64_t> ids = IdsOf(done.cloths);
    Repeat([&](Session& session) {
      done.told_steps.clear();
      done.told_bits.clear();
      for (const ClothState& state : session.ReadStates(ids, WholeView())) {
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
    Repeat([&](Session&) {
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
  const uint64_t id = board_.ForeignTo(options_.tenant, Below(1000));
  if (Chance(2) || id == 0) {
    const auto count = static_cast<uint32_t>(options_.foreign_sessions.size());
    const std::string& name = options_.foreign_sessions[Below(count)];
    if (Chance(2) || !options_.deletes_foreign_sessions) {
      return expect("SESSION_NOT_FOUND", [&] { (void)client_.AttachSession(name); });
    }
    // With its own token.
    v1::DeleteSessionRequest request;
    request.set_name(name);
    grpc::Status status;
    do {
      status = Call(*stub_, &Stub::DeleteSession, request, "Bearer " + options_.token).status;
    } while (status.error_code() == grpc::StatusCode::UNAVAILABLE);
    if (ReasonOf(status) != "SESSION_NOT_FOUND") {
      Complain("a session of another tenant: " + status.error_message());
    }
    ++board_.operations;
    return;
  }
  const std::vector<uint64_t> ids{id};
  v1::StepRequest step;
  step.add_cloth_ids(id);
  step.set_steps(1);
  const std::function<void()> calls[] = {
      [&] { (void)session_.GetCloth(id); }, [&] { (void)session_.Step(step); },
      [&] { (void)session_.ReadStates(ids, WholeView()); }, [&] { session_.ResetCloths(ids); },
      [&] { session_.DeleteCloths(ids); }};
  expect("CLOTH_NOT_FOUND", calls[Below(5)]);
}

void Worker::LookAgain() {
  ++history_.counts["state_lost"];
  saved_.clear();
  for (;;) {
    try {
      v1::Session now;
      Repeat([&](Session&) { now = session_.Reattach(); });
      Repeat([&](Session&) { (void)impatient_session_.Reattach(); });
      std::vector<v1::Cloth> cloths;
      Repeat([&](Session&) { cloths = session_.ListCloths(); });
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
