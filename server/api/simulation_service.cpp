#include "server/api/simulation_service.h"

#include <google/protobuf/descriptor.h>
#include <spdlog/fmt/chrono.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <ctime>
#include <string>
#include <utility>

namespace drape::api {

namespace {

// Until a client has read some of its answers [ms].
constexpr int64_t kRetryWhenUnread_ms = 200;

ServiceContext WithBudget(ServiceContext context) {
  if (context.unread == nullptr) context.unread = MakeUnreadBudget(context.limits);
  return context;
}

// For a client that knows the session from an earlier run of the server.
Status StateLost(const Session& session) {
  uint64_t lowest = UINT64_MAX, highest = 0;
  const Result<ClothList> cloths = session.FindCloths({});
  for (const auto& cloth : cloths.ok() ? cloths.value() : ClothList()) {
    const uint64_t step = cloth->runtime->progress().completed_steps;
    lowest = std::min(lowest, step);
    highest = std::max(highest, step);
  }
  const std::string steps =
      lowest > highest ? "without cloths"
                       : fmt::format("its cloths are now at steps {} to {}", lowest, highest);
  const auto then = static_cast<std::time_t>(session.checkpoint_unix_s());
  return {StatusCode::kFailedPrecondition, "STATE_LOST",
          fmt::format("the server has started again: the session came back as it was at "
                      "{:%Y-%m-%dT%H:%M:%SZ}, and what was done after that is lost; {}",
                      fmt::gmtime(then), steps)};
}

// Among the methods of the service.
int IndexOf(const char* method) {
  const auto* const pool = google::protobuf::DescriptorPool::generated_pool();
  const auto* const service = pool->FindServiceByName(v1::SimulationService::service_full_name());
  return service->FindMethodByName(method)->index();
}

}  // namespace

std::shared_ptr<ByteBudget> MakeUnreadBudget(const RequestLimits& limits) {
  return std::make_shared<ByteBudget>(
      "TOO_MANY_UNREAD_BYTES",
      ByteBudget::Limit{"max_unread_bytes_per_session", limits.max_unread_bytes_per_session},
      ByteBudget::Limit{"max_unread_bytes", limits.max_unread_bytes}, kRetryWhenUnread_ms);
}

Caller ServiceContext::Identify(const grpc::CallbackServerContext& call) const {
  Caller caller = authentication != nullptr ? authentication->Identify(call) : Caller{};
  caller.deadline_us = DeadlineOf_us(call, clock);
  const auto& metadata = call.client_metadata();
  const auto known = metadata.find(kIncarnationHeader);
  if (known != metadata.end()) caller.incarnation = {known->second.data(), known->second.size()};
  return caller;
}

Result<SessionLease> ServiceContext::FindSession(const Caller& caller,
                                                 const std::string& session) const {
  Result<SessionLease> found = sessions.Find(session, caller.tenant);
  if (caller.incarnation.empty() || caller.incarnation == incarnation) return found;
  if (found.ok()) return StateLost(**found);
  if (found.status().reason() != "SESSION_NOT_FOUND") return found;
  return Status(StatusCode::kNotFound, "SESSION_NOT_FOUND",
                "no such session: the server has started again, and it did not come back");
}

SimulationService::SimulationService(ServiceContext context)
    : context_(WithBudget(std::move(context))), start_us_(context_.clock.NowUs()) {
  // gRPC's own way to answer with bytes cannot stand beside the generated class of all methods.
  using Handler = grpc::internal::CallbackBidiHandler<v1::StreamStatesRequest, grpc::ByteBuffer>;
  MarkMethodCallback(IndexOf("StreamStates"),
                     new Handler([this](Context* call) { return StreamEncodedStates(call); }));
}

uint64_t Fingerprint(const google::protobuf::Message& request, std::string_view content) {
  uint64_t hash = 0xcbf29ce484222325u;
  const auto add = [&hash](std::string_view bytes) {
    for (const char byte : bytes) hash = (hash ^ static_cast<unsigned char>(byte)) * 0x100000001b3u;
  };
  add(request.GetTypeName());
  add(request.SerializeAsString());
  add(content);
  return hash;
}

}  // namespace drape::api
