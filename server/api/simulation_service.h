// drape.v1.SimulationService: every handler checks, calls and maps, and returns at once.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "drape/v1/simulation_service.grpc.pb.h"
#include "server/api/authentication.h"
#include "server/api/limits.h"
#include "server/api/unparsed.h"
#include "server/api/worker_pool.h"
#include "server/core/byte_budget.h"
#include "server/core/clock.h"
#include "server/core/memory_reserve.h"
#include "server/core/session_permits.h"
#include "server/render/render_thread.h"
#include "server/scheduler/scheduler.h"
#include "server/session/session_registry.h"

namespace drape::api {

// Of Run and StreamStates calls, since the start except "now". Any thread.
struct StreamCounters {
  std::atomic<uint32_t> runs{0};  // now
  std::atomic<uint64_t> run_steps_dropped{0};
  std::atomic<uint64_t> frames_encoded{0};
};

struct BuildQuota;  // build_queue.h

// The parts that the service uses; all of them outlive the gRPC server.
struct ServiceContext {
  Scheduler& scheduler;
  SessionRegistry& sessions;
  WorkerPool& builders;
  render::RenderThread& pictures;
  const Clock& clock;
  RequestLimits limits;
  std::string version;
  std::string incarnation;  // changes with every start
  // Of requests under way and answers that have not been sent (RequestLimits::max_unread_bytes).
  // Null: the service makes it.
  std::shared_ptr<ByteBudget> unread = nullptr;
  // Who may call. Null: everybody.
  std::shared_ptr<const Authentication> authentication = nullptr;
  std::shared_ptr<StreamCounters> streams = std::make_shared<StreamCounters>();
  // What large requests take once they are parsed. Null: the service makes it.
  std::shared_ptr<ByteBudget> parsed = nullptr;
  // Open streams (RequestLimits::max_streams). Null: the service makes it.
  std::shared_ptr<SessionPermits> open_streams = nullptr;
  // The time of the builders. Null: nobody counts it, and there are no limits.
  std::shared_ptr<BuildQuota> build_quota = nullptr;

  // Also reads kIncarnationHeader and kHalfCloseHeader.
  Caller Identify(const grpc::CallbackServerContext& call) const;
  // A place for a stream of that caller, until the pointer is gone. UNAUTHENTICATED; or
  // RESOURCE_EXHAUSTED (TOO_MANY_STREAMS).
  grpc::Status OpenStream(const Caller& caller, std::shared_ptr<void>& place) const;
  // INVALID_TOKEN if the token of a call that has been under way for a while was taken away.
  Status CheckToken(const Caller& caller) const {
    const bool is_valid = authentication == nullptr || authentication->IsValid(caller);
    return is_valid ? Status::Ok() : TokenTakenAway();
  }
  // Unparsed::Parse within the limits.
  template <class Message>
  Status Parse(Unparsed<Message>& request, const std::string& tenant) const {
    return WithinMemory([&] { return request.Parse(*parsed, tenant, limits.max_parsed_bytes()); });
  }
  // SessionRegistry::Find for the caller. FAILED_PRECONDITION (STATE_LOST) if it came back from an
  // earlier run and the caller knows only that one.
  Result<SessionLease> FindSession(const Caller& caller, const std::string& session) const;
};

// Metadata of requests: the `incarnation` of the server for which they are meant.
inline constexpr char kIncarnationHeader[] = "x-drape-incarnation";
// The client of a stream closes its sending side when a message says `is_end` (ending_stream.h).
inline constexpr char kHalfCloseHeader[] = "x-drape-half-close";

// ServiceContext::unread within these limits.
std::shared_ptr<ByteBudget> MakeUnreadBudget(const RequestLimits& limits);

// What is held for a call until its answer has been sent.
using Hold = std::function<void(std::shared_ptr<void>)>;

// Thread-safe. One file per group of RPCs: session_rpcs.cpp, cloth_rpcs.cpp, step_rpcs.cpp,
// state_rpcs.cpp, render_rpcs.cpp, info_rpcs.cpp. The streams have classes of their own.
class SimulationService final : public v1::SimulationService::CallbackService {
 public:
  using Context = grpc::CallbackServerContext;
  using Reactor = grpc::ServerUnaryReactor;

  explicit SimulationService(ServiceContext context);

  Reactor* CreateSession(Context*, const v1::CreateSessionRequest*, v1::Session*) override;
  Reactor* GetSession(Context*, const v1::GetSessionRequest*, v1::Session*) override;
  Reactor* ListSessions(Context*, const v1::ListSessionsRequest*,
                        v1::ListSessionsResponse*) override;
  Reactor* RenewSession(Context*, const v1::RenewSessionRequest*, v1::Session*) override;
  Reactor* DeleteSession(Context*, const v1::DeleteSessionRequest*,
                         v1::DeleteSessionResponse*) override;

  Reactor* CreateCloths(Context*, const v1::CreateClothsRequest*,
                        v1::CreateClothsResponse*) override;
  Reactor* GetCloth(Context*, const v1::GetClothRequest*, v1::Cloth*) override;
  Reactor* ListCloths(Context*, const v1::ListClothsRequest*, v1::ListClothsResponse*) override;
  Reactor* UpdateCloths(Context*, const v1::UpdateClothsRequest*,
                        v1::UpdateClothsResponse*) override;
  Reactor* DeleteCloths(Context*, const v1::DeleteClothsRequest*,
                        v1::DeleteClothsResponse*) override;
  Reactor* SaveStates(Context*, const v1::SaveStatesRequest*, v1::SaveStatesResponse*) override;
  Reactor* LoadStates(Context*, const v1::LoadStatesRequest*, v1::LoadStatesResponse*) override;
  Reactor* DropStates(Context*, const v1::DropStatesRequest*, v1::DropStatesResponse*) override;
  grpc::ServerWriteReactor<v1::SnapshotChunk>* ExportCloths(
      Context*, const v1::ExportClothsRequest*) override;
  Reactor* ResetCloths(Context*, const v1::ResetClothsRequest*, v1::ResetClothsResponse*) override;
  Reactor* WriteStates(Context*, const v1::WriteStatesRequest*, v1::WriteStatesResponse*) override;
  Reactor* ReadTopology(Context*, const v1::ReadTopologyRequest*, v1::Topology*) override;

  Reactor* Render(Context*, const v1::RenderRequest*, v1::RenderResponse*) override;

  Reactor* GetServerInfo(Context*, const v1::GetServerInfoRequest*, v1::ServerInfo*) override;

 private:
  // The others, under the names of the protocol: streams of requests, and what answers with states.
  // Those answers are serialised already: the states in them are shared, not copied.
  Reactor* StartStep(Context*, const v1::StepRequest*, grpc::ByteBuffer*);
  grpc::ServerWriteReactor<grpc::ByteBuffer>* StartStepInChunks(Context*, const v1::StepRequest*);
  grpc::ServerWriteReactor<grpc::ByteBuffer>* StartReadStates(Context*,
                                                              const v1::ReadStatesRequest*);
  grpc::ServerReadReactor<Unparsed<v1::ImportClothsRequest>>* Import(Context*,
                                                                     v1::ImportClothsResponse*);
  grpc::ServerBidiReactor<Unparsed<v1::StepRequest>, grpc::ByteBuffer>* StartStepStream(Context*);
  grpc::ServerBidiReactor<Unparsed<v1::RunRequest>, v1::RunReport>* StartRun(Context*);
  grpc::ServerBidiReactor<Unparsed<v1::StreamStatesRequest>, grpc::ByteBuffer>* StartStateStream(
      Context*);

  // Puts a method in the place of the generated one, which would parse whatever comes.
  template <class Request, class Response>
  void Serve(const char* name,
             Reactor* (SimulationService::*method)(Context*, const Request*, Response*));
  template <class Request, class Response>
  void Serve(const char* name,
             grpc::ServerWriteReactor<Response>* (SimulationService::*method)(Context*,
                                                                              const Request*));
  template <class Request, class Response>
  void Serve(const char* name,
             grpc::ServerBidiReactor<Request, Response>* (SimulationService::*method)(Context*));
  template <class Request, class Response>
  void Serve(const char* name,
             grpc::ServerReadReactor<Request>* (SimulationService::*method)(Context*, Response*));
  // UNAUTHENTICATED if it is large and the caller has no token.
  template <class Request>
  grpc::Status Parse(const Context& context, const Unparsed<Request>& request) const;

  const ServiceContext context_;
  const int64_t start_us_;
};

// FNV-1a of the serialised request: tells whether a repeated request id means the same request.
uint64_t Fingerprint(const google::protobuf::Message& request, std::string_view content = {});

}  // namespace drape::api
