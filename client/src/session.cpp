#include "drape/session.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "client/src/connection.h"
#include "client/src/errors.h"
#include "client/src/session_impl.h"
#include "client/src/stream_impls.h"

namespace drape {
inline namespace client {
namespace {

// Renewals per lease: two may be lost.
constexpr double kRenewalsPerLease = 3;
// Limits [s] for a destructor, which must not hang on a dead server: it waits for the current
// renewal, then deletes.
constexpr double kMaxRenewalTimeoutS = 2;
constexpr double kDeleteTimeoutS = 2;
constexpr uint32_t kClothsPerPage = 1000;

using Stub = v1::SimulationService::Stub;

}  // namespace

Session::Impl::Impl(std::shared_ptr<Connection> shared_connection, const v1::Session& session,
                    bool is_owned, bool renews_lease)
    : connection(std::move(shared_connection)),
      name(session.name()),
      ttl_s(session.ttl_s()),
      is_owner(is_owned),
      is_renewing(renews_lease),
      incarnation(session.incarnation()) {
  if (renews_lease) renewal = std::thread([this] { RenewLoop(); });
}

Session::Impl::~Impl() {
  StopRenewing();
  if (!is_owner) return;
  try {
    Delete(kDeleteTimeoutS);
  } catch (const Error&) {
    // Then its lease ends it.
  }
}

void Session::Impl::StopRenewing() {
  {
    const std::lock_guard lock(mutex);
    is_renewing = false;
  }
  wake.notify_all();
  if (renewal.joinable()) renewal.join();
}

SessionRoute Session::Impl::Route() const {
  const std::lock_guard lock(mutex);
  return {name, incarnation};
}

void Session::Impl::Send(Twice twice,
                         const std::function<grpc::Status(grpc::ClientContext*)>& once) const {
  try {
    connection->Send(Route(), twice, once);
  } catch (const Error& error) {
    ErrorDetails details = error.details();
    AddLoss(*told_step, &details);
    Throw(std::move(details));
  }
}

States Session::Impl::Read(v1::ReadStatesRequest request) const {
  request.set_session(name);
  std::vector<v1::StateChunk> chunks;
  Send(IfSentTwice(request), [&](grpc::ClientContext* context) {
    chunks.clear();
    const auto reader = connection->stub->ReadStates(context, request);
    for (v1::StateChunk chunk; reader->Read(&chunk);) chunks.push_back(std::move(chunk));
    return reader->Finish();
  });
  return States(std::move(chunks));
}

v1::Session Session::Impl::Renew(double timeout_s) const {
  v1::RenewSessionRequest request;
  request.set_name(name);
  return connection->Call(*connection->stub, &Stub::RenewSession, request, {name}, timeout_s);
}

void Session::Impl::Delete(double timeout_s) const {
  v1::DeleteSessionRequest request;
  request.set_name(name);
  connection->Call(*connection->stub, &Stub::DeleteSession, request, {name}, timeout_s);
}

void Session::Impl::RenewLoop() {
  const std::chrono::duration<double> interval(ttl_s / kRenewalsPerLease);
  std::unique_lock lock(mutex);
  while (!wake.wait_for(lock, interval, [this] { return !is_renewing; })) {
    lock.unlock();
    std::optional<Error> failed;
    try {
      Renew(std::min(interval.count(), kMaxRenewalTimeoutS));
    } catch (const Error& error) {
      failed = error;
    }
    lock.lock();
    // Any other error may be temporary: the next renewal tries again.
    if (failed && failed->code() == ErrorCode::kNotFound) {
      lease_error = std::move(failed);
      return;
    }
  }
}

Session::Session(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;
Session::~Session() = default;

const std::string& Session::name() const {
  return impl_->name;
}

v1::Session Session::Renew() {
  return impl_->Renew(0);
}

v1::Session Session::Reattach() {
  v1::Session session = Renew();
  const std::lock_guard lock(impl_->mutex);
  impl_->incarnation = session.incarnation();
  return session;
}

std::optional<Error> Session::lease_error() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->lease_error;
}

void Session::Detach() {
  impl_->is_owner = false;
}

void Session::Delete() {
  impl_->StopRenewing();
  impl_->is_owner = false;
  impl_->Delete(0);
}

ClothId Session::CreateCloth(const v1::ClothSpec& spec) {
  return CreateCloths(spec, 1).at(0);
}

std::vector<ClothId> Session::CreateCloths(const v1::ClothSpec& spec, uint32_t count) {
  v1::CreateClothsRequest request;
  *request.mutable_spec() = spec;
  request.set_count(count);
  const v1::CreateClothsResponse response = CreateCloths(std::move(request));
  return {response.cloth_ids().begin(), response.cloth_ids().end()};
}

v1::CreateClothsResponse Session::CreateCloths(v1::CreateClothsRequest request) {
  return impl_->Call(&Stub::CreateCloths, std::move(request));
}

v1::Cloth Session::GetCloth(ClothId cloth) const {
  v1::GetClothRequest request;
  request.set_cloth_id(cloth);
  return impl_->Call(&Stub::GetCloth, std::move(request));
}

std::vector<v1::Cloth> Session::ListCloths() const {
  std::vector<v1::Cloth> cloths;
  v1::ListClothsRequest request;
  request.set_page_size(kClothsPerPage);
  do {
    v1::ListClothsResponse page = impl_->Call(&Stub::ListCloths, v1::ListClothsRequest(request));
    request.set_page_token(page.next_page_token());
    for (v1::Cloth& cloth : *page.mutable_cloths()) cloths.push_back(std::move(cloth));
  } while (!request.page_token().empty());
  return cloths;
}

v1::ClothShape Session::UpdateCloths(std::span<const ClothId> cloths, const v1::ClothSpec& spec,
                                     std::span<const std::string> paths) {
  v1::UpdateClothsRequest request;
  request.mutable_cloth_ids()->Add(cloths.begin(), cloths.end());
  *request.mutable_spec() = spec;
  for (const std::string& path : paths) request.mutable_update_mask()->add_paths(path);
  return UpdateCloths(std::move(request));
}

v1::ClothShape Session::UpdateCloths(v1::UpdateClothsRequest request) {
  return impl_->Call(&Stub::UpdateCloths, std::move(request)).shape();
}

void Session::DeleteCloths(std::span<const ClothId> cloths) {
  v1::DeleteClothsRequest request;
  request.mutable_cloth_ids()->Add(cloths.begin(), cloths.end());
  DeleteCloths(std::move(request));
}

void Session::DeleteCloths(v1::DeleteClothsRequest request) {
  impl_->Call(&Stub::DeleteCloths, std::move(request));
}

void Session::ResetCloths(std::span<const ClothId> cloths) {
  v1::ResetClothsRequest request;
  request.mutable_cloth_ids()->Add(cloths.begin(), cloths.end());
  ResetCloths(std::move(request));
}

void Session::ResetCloths() {
  v1::ResetClothsRequest request;
  request.set_all_cloths(true);
  ResetCloths(std::move(request));
}

void Session::ResetCloths(v1::ResetClothsRequest request) {
  impl_->Call(&Stub::ResetCloths, std::move(request));
}

v1::StepResponse Session::Step(uint32_t steps) {
  v1::StepRequest request;
  request.set_all_cloths(true);
  request.set_steps(steps);
  return Step(std::move(request));
}

v1::StepResponse Session::Step(v1::StepRequest request) {
  v1::StepResponse response = impl_->Call(&Stub::Step, std::move(request));
  NoteSteps(response, *impl_->told_step);
  return response;
}

SteppedStates Session::StepStates(v1::StepRequest request) {
  request.set_session(impl_->name);
  impl_->GiveId(&request);
  StepParts parts;
  impl_->Send(IfSentTwice(request), [&](grpc::ClientContext* context) {
    parts.Clear();
    const auto reader = impl_->connection->stub->StepInChunks(context, request);
    for (v1::StepResponse part; reader->Read(&part);) parts.Add(std::move(part));
    return reader->Finish();
  });
  SteppedStates stepped = parts.Take();
  NoteSteps(stepped.answer, *impl_->told_step);
  return stepped;
}

StepStream Session::OpenStepStream() {
  return StepStream(
      std::make_unique<StepStream::Impl>(impl_->connection, impl_->Route(), impl_->told_step));
}

RunStream Session::Run(v1::RunRequest::Start start) {
  start.set_session(impl_->name);
  if (start.cloth_ids().empty()) start.set_all_cloths(true);
  return RunStream(
      std::make_unique<RunStream::Impl>(impl_->connection, impl_->Route(), std::move(start)));
}

States Session::ReadStates(std::span<const ClothId> cloths, const v1::StateView& view) const {
  v1::ReadStatesRequest request;
  request.mutable_cloth_ids()->Add(cloths.begin(), cloths.end());
  *request.mutable_view() = view;
  return impl_->Read(std::move(request));
}

States Session::ReadStates(const v1::StateView& view) const {
  v1::ReadStatesRequest request;
  request.set_all_cloths(true);
  *request.mutable_view() = view;
  return impl_->Read(std::move(request));
}

void Session::WriteStates(v1::WriteStatesRequest request) {
  impl_->Call(&Stub::WriteStates, std::move(request));
}

v1::SaveStatesResponse Session::SaveStates(v1::SaveStatesRequest request) {
  return impl_->Call(&Stub::SaveStates, std::move(request));
}

void Session::LoadStates(v1::LoadStatesRequest request) {
  impl_->Call(&Stub::LoadStates, std::move(request));
}

void Session::DropStates(const std::string& name) {
  v1::DropStatesRequest request;
  request.set_name(name);
  DropStates(std::move(request));
}

void Session::DropStates(v1::DropStatesRequest request) {
  impl_->Call(&Stub::DropStates, std::move(request));
}

v1::Topology Session::ReadTopology(ClothId cloth) const {
  v1::ReadTopologyRequest request;
  request.set_cloth_id(cloth);
  return impl_->Call(&Stub::ReadTopology, std::move(request));
}

v1::RenderResponse Session::Render(v1::RenderRequest request) const {
  return impl_->Call(&Stub::Render, std::move(request));
}

StateStream Session::StreamStates(v1::StreamStatesRequest::Subscribe subscribe) const {
  subscribe.set_session(impl_->name);
  return StateStream(
      std::make_unique<StateStream::Impl>(impl_->connection, impl_->Route(), std::move(subscribe)));
}

}  // namespace client
}  // namespace drape
