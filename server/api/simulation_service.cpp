#include "server/api/simulation_service.h"

#include <google/protobuf/descriptor.h>

#include <utility>

namespace drape::api {

namespace {

// Until a client has read some of its answers [ms].
constexpr int64_t kRetryWhenUnread_ms = 200;

ServiceContext WithBudget(ServiceContext context) {
  if (context.unread == nullptr) context.unread = MakeUnreadBudget(context.limits);
  return context;
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
  DRAPE_ASSIGN_OR_RETURN(SessionLease found, sessions.Find(session, caller.tenant));
  if (caller.incarnation.empty() || caller.incarnation == incarnation) return found;
  return Status(StatusCode::kFailedPrecondition, "STATE_LOST",
                "the server has started again: the session came back as it was at some moment "
                "before, and what was done after that is lost");
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
