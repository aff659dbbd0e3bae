// Sessions: create, look, renew, delete.
#include "server/api/mapping.h"
#include "server/api/simulation_service.h"
#include "server/api/unary_call.h"

namespace drape::api {
namespace {

Status FillSession(const ServiceContext& context, const Result<SessionView>& view,
                   v1::Session* response) {
  if (!view.ok()) return view.status();
  *response = ToProto(*view);
  response->set_incarnation(context.incarnation);
  return Status::Ok();
}

}  // namespace

grpc::ServerUnaryReactor* SimulationService::CreateSession(Context* context,
                                                           const v1::CreateSessionRequest* request,
                                                           v1::Session* response) {
  const Caller caller = context_.Identify(*context);
  if (caller.is_refused) return Refuse(context);
  const RequestTag tag(caller, *request);
  const double ttl_s = request->has_ttl_s() ? request->ttl_s() : context_.limits.default_ttl_s;
  const Result<SessionLease> session =
      context_.sessions.Create(ttl_s, request->display_name(), caller.tenant);
  if (!session.ok()) return Answer(context, session.status(), tag);
  return Answer(
      context,
      FillSession(context_, context_.sessions.Get((*session)->name(), caller.tenant), response),
      tag);
}

grpc::ServerUnaryReactor* SimulationService::GetSession(Context* context,
                                                        const v1::GetSessionRequest* request,
                                                        v1::Session* response) {
  const Caller caller = context_.Identify(*context);
  if (caller.is_refused) return Refuse(context);
  const RequestTag tag(caller, *request);
  return Answer(
      context,
      FillSession(context_, context_.sessions.Get(request->name(), caller.tenant), response), tag);
}

grpc::ServerUnaryReactor* SimulationService::ListSessions(Context* context,
                                                          const v1::ListSessionsRequest* request,
                                                          v1::ListSessionsResponse* response) {
  const Caller caller = context_.Identify(*context);
  if (caller.is_refused) return Refuse(context);
  const RequestTag tag(caller, *request);
  const Result<SessionPage> page =
      context_.sessions.List(request->page_size(), request->page_token(), caller.tenant);
  if (!page.ok()) return Answer(context, page.status(), tag);
  for (const SessionView& session : page->sessions) {
    v1::Session* message = response->add_sessions();
    *message = ToProto(session);
    message->set_name(ShortSessionName(session.name));
  }
  response->set_next_page_token(page->next_page_token);
  return AnswerCounted(*context_.unread, caller.tenant, *response, tag);
}

grpc::ServerUnaryReactor* SimulationService::RenewSession(Context* context,
                                                          const v1::RenewSessionRequest* request,
                                                          v1::Session* response) {
  const Caller caller = context_.Identify(*context);
  if (caller.is_refused) return Refuse(context);
  const RequestTag tag(caller, *request);
  return Answer(
      context,
      FillSession(context_, context_.sessions.Renew(request->name(), caller.tenant), response),
      tag);
}

grpc::ServerUnaryReactor* SimulationService::DeleteSession(Context* context,
                                                           const v1::DeleteSessionRequest* request,
                                                           v1::DeleteSessionResponse*) {
  const Caller caller = context_.Identify(*context);
  if (caller.is_refused) return Refuse(context);
  const RequestTag tag(caller, *request);
  UnaryCall* call = UnaryCall::New(tag);
  context_.sessions.Delete(
      request->name(), [call](const Status& status) { call->End(status); }, caller.tenant);
  return call;
}

}  // namespace drape::api
