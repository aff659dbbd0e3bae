#include "server/api/admin_service.h"

#include <grpcpp/alarm.h>

#include <chrono>
#include <map>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>

#include "server/api/build_queue.h"
#include "server/api/unary_call.h"
#include "server/core/log.h"
#include "server/core/trace.h"
#include "server/core/violations.h"

namespace drape::api {
namespace {

// Checkpoints are written on a builder thread, in turn with the models of tenants.
constexpr char kOwner[] = "@admin";  // no name of a tenant

// What is counted per owner: a tenant, or each session where there are no tenants.
void AddOwner(const ServiceContext& parts, const std::string& owner, const QueuedRequests& queued,
              v1::TenantUse& use) {
  const auto requests = queued.by_owner.find(owner);
  if (requests != queued.by_owner.end()) {
    use.set_queued_requests(use.queued_requests() + requests->second);
  }
  use.set_queued_builds(use.queued_builds() + parts.builders.queued_count(owner));
  use.set_unread_bytes(use.unread_bytes() + parts.unread->used_bytes(owner));
  use.set_saved_bytes(use.saved_bytes() + parts.sessions.saved_bytes(owner));
  use.set_remembered_bytes(use.remembered_bytes() + parts.sessions.remembered_bytes(owner));
}

v1::TenantUse UseOf(const ServiceContext& parts, const std::string& tenant,
                    const TenantTotals& totals, const QueuedRequests& queued) {
  v1::TenantUse use;
  use.set_name(tenant);
  use.set_session_count(totals.totals.session_count);
  use.set_cloth_count(totals.totals.cloth_count);
  use.set_particle_count(totals.totals.particle_count);
  use.set_max_particle_substeps_per_s(parts.scheduler.rates().LimitOf(tenant));
  if (parts.build_quota != nullptr) {
    use.set_max_builder_s_per_s(parts.build_quota->rates.LimitOf(tenant));
  }
  for (const std::string& owner : totals.owners) AddOwner(parts, owner, queued, use);
  return use;
}

void AddRate(const RateUse& rate, v1::TenantUse& use) {
  use.set_particle_substeps(static_cast<uint64_t>(rate.work));
  use.set_particle_substeps_per_s(rate.work_per_s);
  use.set_rate_wait_s(static_cast<double>(rate.wait_us) / 1e6);
}

void AddBuilderRate(const RateUse& rate, v1::TenantUse& use) {
  use.set_builder_s(rate.work);
  use.set_builder_s_per_s(rate.work_per_s);
  use.set_builder_wait_s(static_cast<double>(rate.wait_us) / 1e6);
}

std::vector<RateUse> BuilderUses(const ServiceContext& parts) {
  return parts.build_quota == nullptr ? std::vector<RateUse>() : parts.build_quota->rates.Uses();
}

// Length of a recording [s].
constexpr double kShortestTrace_s = 0.001;
constexpr double kLongestTrace_s = 60;

Status CheckDuration(double duration_s) {
  Violations violations;
  violations.InRange("duration_s", duration_s, {kShortestTrace_s, kLongestTrace_s, "s"});
  return violations.ToStatus();
}

// A recording; ends early when the client or the server goes.
class TraceReactor final : public grpc::ServerUnaryReactor {
 public:
  TraceReactor(double duration_s, v1::RecordTraceResponse* response) : response_(response) {
    const Status status = trace::Start();
    if (!status.ok()) {
      Finish(ToGrpcStatus(status));
      return;
    }
    spdlog::info("trace_started duration_s={}", duration_s);
    const auto duration = std::chrono::duration_cast<std::chrono::microseconds>(
        std::chrono::duration<double>(duration_s));
    alarm_.Set(std::chrono::system_clock::now() + duration, [this](bool) { End(); });
  }

 private:
  void OnCancel() override { alarm_.Cancel(); }
  void OnDone() override { delete this; }

  void End() {
    trace::Recording recording = trace::Stop();
    spdlog::info("trace_ended events={} left_out={}", recording.events, recording.left_out);
    response_->set_json(std::move(recording.json));
    response_->set_events(recording.events);
    response_->set_events_left_out(recording.left_out);
    Finish(grpc::Status::OK);
  }

  v1::RecordTraceResponse* const response_;
  grpc::Alarm alarm_;
};

}  // namespace

AdminService::Reactor* AdminService::RefuseOthers(Context* context) const {
  const Authentication* const authentication = context_.parts.authentication.get();
  if (is_trusted_ || (authentication != nullptr && authentication->IsOperator(*context))) {
    return nullptr;
  }
  auto* reactor = context->DefaultReactor();
  reactor->Finish(context_.parts.Identify(*context).is_refused ? Unauthenticated() : AdminOnly());
  return reactor;
}

AdminService::Reactor* AdminService::ListTenants(Context* context, const v1::ListTenantsRequest*,
                                                 v1::ListTenantsResponse* response) {
  if (Reactor* const refusal = RefuseOthers(context)) return refusal;
  const ServiceContext& parts = context_.parts;
  std::map<std::string, TenantTotals> totals = parts.sessions.TotalsByTenant();
  const std::vector<RateUse> rates = parts.scheduler.rates().Uses();
  const std::vector<RateUse> builder_rates = BuilderUses(parts);
  for (const RateUse& rate : rates) totals[rate.tenant];
  for (const RateUse& rate : builder_rates) totals[rate.tenant];
  if (parts.authentication != nullptr) {
    for (const std::string& tenant : parts.authentication->tenants()) totals[tenant];
  }
  const QueuedRequests queued = parts.scheduler.queued_requests();
  std::map<std::string, v1::TenantUse> uses;
  for (auto& [tenant, of_tenant] : totals) {
    if (!tenant.empty()) of_tenant.owners = {tenant};
    uses[tenant] = UseOf(parts, tenant, of_tenant, queued);
  }
  for (const RateUse& rate : rates) AddRate(rate, uses[rate.tenant]);
  for (const RateUse& rate : builder_rates) AddBuilderRate(rate, uses[rate.tenant]);
  for (auto& [tenant, use] : uses) *response->add_tenants() = std::move(use);
  return Answer(context, Status::Ok());
}

AdminService::Reactor* AdminService::ListAllSessions(Context* context,
                                                     const v1::ListAllSessionsRequest* request,
                                                     v1::ListAllSessionsResponse* response) {
  if (Reactor* const refusal = RefuseOthers(context)) return refusal;
  const Result<SessionPage> page =
      context_.parts.sessions.ListAll(request->page_size(), request->page_token());
  if (!page.ok()) return Answer(context, page.status());
  const QueuedRequests queued = context_.parts.scheduler.queued_requests();
  for (const SessionView& session : page->sessions) {
    v1::TenantSession* message = response->add_sessions();
    message->set_number(session.number);
    message->set_short_name(ShortSessionName(session.name));
    message->set_tenant(session.tenant);
    message->set_display_name(session.display_name);
    message->set_ttl_s(session.ttl_s);
    message->set_remaining_s(session.remaining_s);
    message->set_cloth_count(session.cloth_count);
    message->set_particle_count(session.particle_count);
    const auto requests = queued.by_session.find(session.name);
    if (requests != queued.by_session.end()) message->set_queued_requests(requests->second);
  }
  response->set_next_page_token(page->next_page_token);
  return Answer(context, Status::Ok());
}

AdminService::Reactor* AdminService::DropSession(Context* context,
                                                 const v1::DropSessionRequest* request,
                                                 v1::DropSessionResponse*) {
  if (Reactor* const refusal = RefuseOthers(context)) return refusal;
  UnaryCall* call = UnaryCall::New();
  context_.parts.sessions.Drop(request->number(),
                               [call](const Status& status) { call->End(status); });
  return call;
}

AdminService::Reactor* AdminService::Drain(Context* context, const v1::DrainRequest*,
                                           v1::DrainResponse*) {
  if (Reactor* const refusal = RefuseOthers(context)) return refusal;
  spdlog::info("drain_requested by=operator");
  context_.drain();
  return Answer(context, Status::Ok());
}

AdminService::Reactor* AdminService::WriteCheckpoints(Context* context,
                                                      const v1::WriteCheckpointsRequest*,
                                                      v1::WriteCheckpointsResponse* response) {
  if (Reactor* const refusal = RefuseOthers(context)) return refusal;
  if (!context_.write_checkpoints) {
    return Answer(context, {StatusCode::kFailedPrecondition, "NO_CHECKPOINTS",
                            "the server keeps no sessions: it has no --checkpoint-dir"});
  }
  UnaryCall* call = UnaryCall::New();
  const Status posted = context_.parts.builders.Post(kOwner, [this, call, response] {
    const ServiceContext& parts = context_.parts;
    if (parts.scheduler.is_draining()) return call->End(DrainingStatus());
    const int64_t begin_us = parts.clock.NowUs();
    response->set_session_count(static_cast<uint32_t>(parts.sessions.All().size()));
    const Status written = context_.write_checkpoints();
    response->set_duration_s(static_cast<double>(parts.clock.NowUs() - begin_us) / 1e6);
    call->End(written);
  });
  if (!posted.ok()) call->End(posted);
  return call;
}

AdminService::Reactor* AdminService::SetLogLevel(Context* context,
                                                 const v1::SetLogLevelRequest* request,
                                                 v1::SetLogLevelResponse* response) {
  if (Reactor* const refusal = RefuseOthers(context)) return refusal;
  response->set_former_level(LogLevel());
  const Status status = drape::SetLogLevel(request->level());
  if (status.ok()) spdlog::info("log_level_set new_level={}", request->level());
  return Answer(context, status);
}

AdminService::Reactor* AdminService::RecordTrace(Context* context,
                                                 const v1::RecordTraceRequest* request,
                                                 v1::RecordTraceResponse* response) {
  if (Reactor* const refusal = RefuseOthers(context)) return refusal;
  const Status check = CheckDuration(request->duration_s());
  if (!check.ok()) return Answer(context, check);
  return new TraceReactor(request->duration_s(), response);
}

}  // namespace drape::api
