// GetServerInfo: the backend, the device and the limits of this server.
#include "server/api/build_queue.h"
#include "server/api/picture_validation.h"
#include "server/api/simulation_service.h"
#include "server/api/unary_call.h"

namespace drape::api {
namespace {

void FillLimits(const ServiceContext& context, v1::ServerInfo::Limits* limits) {
  limits->set_max_request_bytes(context.limits.max_request_bytes);
  limits->set_max_chunk_bytes(context.limits.max_chunk_bytes);
  limits->set_max_particles_per_cloth(context.limits.model.max_particles);
  limits->set_max_constraints_per_cloth(context.limits.model.max_constraints);
  limits->set_max_colliders_per_cloth(context.limits.max_colliders_per_cloth);
  limits->set_max_mesh_colliders_per_cloth(context.limits.max_mesh_colliders_per_cloth);
  limits->set_max_bodies_per_cloth(context.limits.max_bodies_per_cloth);
  limits->set_max_triangles_per_mesh_collider(context.limits.collider_mesh.max_triangles);
  limits->set_max_mesh_collider_bytes_per_session(
      context.sessions.limits().max_mesh_collider_bytes_per_session);
  limits->set_max_cloths_per_session(context.sessions.limits().max_cloths_per_session);
  limits->set_max_particles_per_session(context.sessions.limits().max_particles_per_session);
  limits->set_max_sessions(context.sessions.limits().max_sessions);
  limits->set_max_queued_requests_per_session(
      context.scheduler.limits().max_queued_requests_per_session);
  limits->set_max_substeps(kMaxSubsteps);
  limits->set_max_iterations(kMaxIterations);
  limits->set_max_steps_per_request(context.scheduler.limits().max_steps_per_request);
  limits->set_max_solves_per_step(kMaxSolvesPerStep);
  const render::RenderLimits& pictures = context.pictures.limits();
  limits->set_max_picture_edge_px(kMaxPictureEdge_px);
  limits->set_max_particles_per_picture(pictures.max_particles_per_picture);
  limits->set_max_colliders_per_picture(pictures.max_colliders_per_picture);
  limits->set_max_pictures_in_flight_per_session(pictures.max_pictures_in_flight_per_session);
}

}  // namespace

grpc::ServerUnaryReactor* SimulationService::GetServerInfo(Context* context,
                                                           const v1::GetServerInfoRequest* request,
                                                           v1::ServerInfo* response) {
  const Caller caller = context_.Identify(*context);
  if (caller.is_refused) return Refuse(context);
  const RequestTag tag(caller, *request);
  const BackendDescription& backend = context_.scheduler.description();
  const ServerTotals totals = context_.sessions.Totals(caller.tenant);
  response->set_version(context_.version);
  response->set_incarnation(context_.incarnation);
  response->set_backend(backend.name);
  response->set_device(backend.device);
  response->set_has_impulses(true);
  response->set_precision(backend.scalar == ScalarType::kFloat64 ? "float64" : "float32");
  FillLimits(context_, response->mutable_limits());
  response->mutable_limits()->set_max_particle_substeps_per_s(
      context_.scheduler.rates().LimitOf(caller.tenant));
  if (context_.build_quota != nullptr) {
    response->mutable_limits()->set_max_builder_s_per_s(
        context_.build_quota->rates.LimitOf(caller.tenant));
  }
  response->set_session_count(totals.session_count);
  response->set_cloth_count(totals.cloth_count);
  response->set_particle_count(totals.particle_count);
  response->set_uptime_s(static_cast<double>(context_.clock.NowUs() - start_us_) * 1e-6);
  return Answer(context, Status::Ok(), tag);
}

}  // namespace drape::api
