#include "server/api/simulation_service.h"

#include <google/protobuf/descriptor.h>
#include <spdlog/fmt/chrono.h>
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <ctime>
#include <string>
#include <utility>

#include "server/api/status_mapping.h"

namespace drape::api {

namespace {

// Until a client has read some of its answers [ms].
constexpr int64_t kRetryWhenUnread_ms = 200;

// A tenant gets half, as does everybody together on a server without tenants.
std::shared_ptr<ByteBudget> MakeParsedBudget(const RequestLimits& limits) {
  return std::make_shared<ByteBudget>(
      "TOO_MANY_REQUEST_BYTES",
      ByteBudget::Limit{"half of max_unread_bytes", limits.max_unread_bytes / 2},
      ByteBudget::Limit{"max_unread_bytes", limits.max_unread_bytes}, kRetryWhenUnread_ms);
}

ServiceContext WithBudgets(ServiceContext context) {
  if (context.unread == nullptr) context.unread = MakeUnreadBudget(context.limits);
  if (context.parsed == nullptr) context.parsed = MakeParsedBudget(context.limits);
  if (context.open_streams == nullptr) {
    context.open_streams = std::make_shared<SessionPermits>(
        "TOO_MANY_STREAMS", PermitLimit{"max_streams", context.limits.max_streams},
        PermitLimit{"max_streams", context.limits.max_streams}, std::nullopt);
  }
  return context;
}

// For a client that knows the session from another run of the server.
Status StateLost(const Session& session) {
  if (session.checkpoint_unix_s() == 0) {
    return {StatusCode::kFailedPrecondition, "STATE_LOST",
            "the request is for another run of the server (x-drape-incarnation), in which this "
            "session was not: it was created in the present one; nothing is done"};
  }
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
                      "{:%Y-%m-%dT%H:%M:%SZ}. If the server had ended in order nothing is lost, "
                      "else what was done after that: compare `step`; {}",
                      fmt::gmtime(then), steps)};
}

// Among the methods of the service.
int IndexOf(const char* method) {
  const auto* const pool = google::protobuf::DescriptorPool::generated_pool();
  const auto* const service = pool->FindServiceByName(v1::SimulationService::service_full_name());
  return service->FindMethodByName(method)->index();
}

// Ends a call without an answer.
template <class Message>
class Refusal final : public grpc::ServerWriteReactor<Message> {
 public:
  explicit Refusal(const grpc::Status& status) { this->Finish(status); }
  void OnDone() override { delete this; }
};

}  // namespace

std::shared_ptr<ByteBudget> MakeUnreadBudget(const RequestLimits& limits) {
  return std::make_shared<ByteBudget>(
      "TOO_MANY_UNREAD_BYTES",
      ByteBudget::Limit{"max_unread_bytes_per_session", limits.max_unread_bytes_per_session},
      ByteBudget::Limit{"max_unread_bytes", limits.max_unread_bytes}, kRetryWhenUnread_ms,
      limits.max_unread_bytes / 2);
}

Caller ServiceContext::Identify(const grpc::CallbackServerContext& call) const {
  Caller caller = authentication != nullptr ? authentication->Identify(call) : Caller{};
  if (caller.is_refused) spdlog::debug("call_refused peer={}", call.peer());
  caller.deadline_us = DeadlineOf_us(call, clock);
  const auto& metadata = call.client_metadata();
  const auto known = metadata.find(kIncarnationHeader);
  if (known != metadata.end()) caller.incarnation = {known->second.data(), known->second.size()};
  caller.half_closes = metadata.find(kHalfCloseHeader) != metadata.end();
  return caller;
}

grpc::Status ServiceContext::OpenStream(const Caller& caller, std::shared_ptr<void>& place) const {
  if (caller.is_refused) return Unauthenticated();
  auto taken = open_streams->Take({}, caller.tenant);
  if (taken.ok()) place = std::move(taken).value();
  return ToGrpcStatus(taken.status());
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
    : context_(WithBudgets(std::move(context))), start_us_(context_.clock.NowUs()) {
  using S = SimulationService;
  Serve("CreateSession", &S::CreateSession);
  Serve("GetSession", &S::GetSession);
  Serve("ListSessions", &S::ListSessions);
  Serve("RenewSession", &S::RenewSession);
  Serve("DeleteSession", &S::DeleteSession);
  Serve("CreateCloths", &S::CreateCloths);
  Serve("GetCloth", &S::GetCloth);
  Serve("ListCloths", &S::ListCloths);
  Serve("UpdateCloths", &S::UpdateCloths);
  Serve("DeleteCloths", &S::DeleteCloths);
  Serve("SaveStates", &S::SaveStates);
  Serve("LoadStates", &S::LoadStates);
  Serve("DropStates", &S::DropStates);
  Serve("ExportCloths", &S::ExportCloths);
  Serve("ImportCloths", &S::Import);
  Serve("ResetCloths", &S::ResetCloths);
  Serve("WriteStates", &S::WriteStates);
  Serve("ReadTopology", &S::ReadTopology);
  Serve("Step", &S::StartStep);
  Serve("StepInChunks", &S::StartStepInChunks);
  Serve("StepStream", &S::StartStepStream);
  Serve("Run", &S::StartRun);
  Serve("ReadStates", &S::StartReadStates);
  Serve("StreamStates", &S::StartStateStream);
  Serve("Render", &S::Render);
  Serve("GetServerInfo", &S::GetServerInfo);
}

template <class Request>
grpc::Status SimulationService::Parse(const Context& context,
                                      const Unparsed<Request>& request) const {
  std::string tenant;
  if (request.is_large()) {
    const Caller caller = context_.Identify(context);
    if (caller.is_refused) return Unauthenticated();
    tenant = caller.tenant;
  }
  // It is gRPC's, which made it for this call and only looks at it again to delete it.
  return ToGrpcStatus(context_.Parse(const_cast<Unparsed<Request>&>(request), tenant));
}

template <class Request, class Response>
void SimulationService::Serve(const char* name,
                              Reactor* (SimulationService::*method)(Context*, const Request*,
                                                                    Response*)) {
  using Handler = grpc::internal::CallbackUnaryHandler<Unparsed<Request>, Response>;
  const auto serve = [this, method](Context* context, const Unparsed<Request>* request,
                                    Response* response) -> Reactor* {
    grpc::Status status = Parse(*context, *request);
    if (status.ok()) {
      // What has begun a call of its own ends it itself.
      const Result<Reactor*> begun = WithinMemory([&]() -> Result<Reactor*> {
        return (this->*method)(context, &request->message(), response);
      });
      if (begun.ok()) return *begun;
      response->Clear();
      status = ToGrpcStatus(begun.status());
    }
    Reactor* reactor = context->DefaultReactor();
    reactor->Finish(status);
    return reactor;
  };
  MarkMethodCallback(IndexOf(name), new Handler(serve));
}

template <class Request, class Response>
void SimulationService::Serve(
    const char* name,
    grpc::ServerWriteReactor<Response>* (SimulationService::*method)(Context*, const Request*)) {
  using Handler = grpc::internal::CallbackServerStreamingHandler<Unparsed<Request>, Response>;
  const auto serve = [this, method](
                         Context* context,
                         const Unparsed<Request>* request) -> grpc::ServerWriteReactor<Response>* {
    const grpc::Status status = Parse(*context, *request);
    if (status.ok()) return (this->*method)(context, &request->message());
    return new Refusal<Response>(status);
  };
  MarkMethodCallback(IndexOf(name), new Handler(serve));
}

template <class Request, class Response>
void SimulationService::Serve(const char* name, grpc::ServerBidiReactor<Request, Response>* (
                                                    SimulationService::*method)(Context*)) {
  using Handler = grpc::internal::CallbackBidiHandler<Request, Response>;
  MarkMethodCallback(IndexOf(name), new Handler([this, method](Context* context) {
                       return (this->*method)(context);
                     }));
}

template <class Request, class Response>
void SimulationService::Serve(
    const char* name,
    grpc::ServerReadReactor<Request>* (SimulationService::*method)(Context*, Response*)) {
  using Handler = grpc::internal::CallbackClientStreamingHandler<Request, Response>;
  MarkMethodCallback(IndexOf(name),
                     new Handler([this, method](Context* context, Response* response) {
                       return (this->*method)(context, response);
                     }));
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
