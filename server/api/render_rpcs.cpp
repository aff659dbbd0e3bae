// Pictures: the states are fetched when a picture's turn has come, drawn, and sent as a file.
#include <cmath>

#include "server/api/mapping.h"
#include "server/api/picture_validation.h"
#include "server/api/request_validation.h"
#include "server/api/simulation_service.h"
#include "server/api/unary_call.h"
#include "server/core/memory_reserve.h"
#include "server/solver/step_impulses.h"

namespace drape::api {
namespace {

// One picture under way. Shared by the functions of its job.
struct PictureCall {
  UnaryCall* call = nullptr;
  v1::RenderResponse* response = nullptr;
  ClothList cloths;
  bool has_colliders = true;
  bool has_forces = false;     // of contacts
  std::shared_ptr<void> held;  // for the bytes of its answer
};

// What the answer may have. A file is hardly larger than its pixels, mostly much smaller.
uint64_t AnswerBytes(const render::PictureSpec& spec, size_t cloth_count) {
  const uint64_t pixels =
      uint64_t{spec.width_px} * spec.height_px * (spec.is_tiled ? cloth_count : 1);
  return pixels * (3 + (spec.has_depths ? sizeof(float) : 0));
}

Status NoCloths() {
  return {StatusCode::kFailedPrecondition, "NO_CLOTHS", "the session has no cloths to draw"};
}

uint64_t ParticleTotal(const ClothList& cloths) {
  uint64_t total = 0;
  for (const auto& cloth : cloths) total += cloth->description()->model->particle_count();
  return total;
}

// Device thread. A vector of each particle, as long as what contacts gave to it in the last step
// [N].
Result<std::vector<float>> ForcesOfContacts(const ClothList& cloths) {
  std::vector<float> forces;
  for (const auto& cloth : cloths) {
    const StepImpulses* const impulses = cloth->runtime->last_contacts();
    if (impulses == nullptr) {
      return Status(StatusCode::kFailedPrecondition, "NO_CONTACTS",
                    "the last step of cloth " + std::to_string(cloth->id.Packed()) +
                        " was not asked for contact_impulses, or its state or time step has "
                        "changed since: CONTACT shows what they were");
    }
    const auto description = cloth->description();
    const size_t first = forces.size();
    forces.resize(first + size_t{3} * description->model->particle_count());
    for (const ParticleImpulse& contact : *impulses->contacts) {
      const double force_n =
          contact.impulse_n_s.norm() / description->parameters.settings.time_step_s;
      if (std::isfinite(force_n)) {
        forces[first + size_t{3} * contact.particle] += static_cast<float>(force_n);
      }
    }
  }
  return forces;
}

// Device thread: description and state are of the same moment.
Result<render::PictureContent> ToContent(const PictureCall& picture, Result<ClothStates> states,
                                         const render::RenderLimits& limits) {
  if (!states.ok()) return states.status();
  render::PictureContent content;
  uint64_t colliders = 0;
  for (const auto& cloth : picture.cloths) {
    const auto description = cloth->description();
    render::DrawnCloth drawn{description->model, cloth->placement, {}};
    if (picture.has_colliders) {
      drawn.colliders = DrawnColliders(*cloth);
      colliders += drawn.colliders.size();
      if (colliders > limits.max_colliders_per_picture) {
        return render::PictureTooLarge("max_colliders_per_picture", colliders,
                                       limits.max_colliders_per_picture);
      }
    }
    content.cloths.push_back(std::move(drawn));
  }
  for (const ClothStamp& stamp : states->cloths) content.steps.push_back(stamp.completed_steps);
  content.states = {std::move(states->columns), std::move(states->on_device)};
  if (picture.has_forces) {
    DRAPE_ASSIGN_OR_RETURN(content.states.host.velocities_m_per_s,
                           ForcesOfContacts(picture.cloths));
  }
  content.in_flight = std::move(states->in_flight);
  return content;
}

void Fetch(const ServiceContext& context, const std::shared_ptr<PictureCall>& picture,
           StateFields fields, bool on_device, const render::ContentReady& ready) {
  std::vector<std::shared_ptr<ClothRuntime>> runtimes;
  for (const auto& cloth : picture->cloths) runtimes.push_back(cloth->runtime);
  const Status status = context.scheduler.ReadForDrawing(
      std::move(runtimes), fields, on_device,
      [picture, ready, limits = context.pictures.limits()](Result<ClothStates> states) {
        ready(WithinMemory([&] { return ToContent(*picture, std::move(states), limits); }));
      },
      picture->call->lease->name(), picture->call->lease->tenant(), picture->call->cancel);
  if (!status.ok()) ready(status);
}

void End(PictureCall& picture, Result<render::DrawnPicture> drawn) {
  Status status = drawn.status();
  if (status.ok()) {
    using Held = std::pair<std::shared_ptr<void>, std::shared_ptr<void>>;
    picture.call->until_sent =
        std::make_shared<Held>(std::move(drawn->in_flight), std::move(picture.held));
    status = WithinMemory([&] {
      *picture.response = ToProto(picture.cloths, std::move(*drawn));
      return Status::Ok();
    });
  }
  picture.call->End(status);
}

render::PictureJob ToJob(const ServiceContext& context, render::PictureSpec spec,
                         const std::shared_ptr<PictureCall>& picture, int64_t deadline_us) {
  const StateFields fields{.positions = true,
                           .velocities = spec.colouring == render::Colouring::kSpeed};
  render::PictureJob job;
  job.session = picture->call->lease->name();
  job.tenant = picture->call->lease->tenant();
  job.spec = std::move(spec);
  job.particle_count = ParticleTotal(picture->cloths);
  job.fetch = [&context, picture, fields](bool on_device, const render::ContentReady& ready) {
    Fetch(context, picture, fields, on_device && !picture->has_forces, ready);
  };
  job.is_cancelled = [&clock = context.clock, cancel = picture->call->cancel, deadline_us] {
    return cancel.is_cancelled() || clock.NowUs() >= deadline_us;
  };
  job.done = [picture](Result<render::DrawnPicture> drawn) { End(*picture, std::move(drawn)); };
  return job;
}

}  // namespace

grpc::ServerUnaryReactor* SimulationService::Render(Context* context,
                                                    const v1::RenderRequest* request,
                                                    v1::RenderResponse* response) {
  const Caller caller = context_.Identify(*context);
  if (caller.is_refused) return Refuse(context);
  const RequestTag tag(caller, *request);
  Result<render::PictureSpec> spec = CheckRender(*request);
  if (!spec.ok()) return Answer(context, spec.status(), tag);
  const Result<std::vector<ClothId>> ids = CheckSelection(*request);
  if (!ids.ok()) return Answer(context, ids.status(), tag);
  Result<SessionLease> session = context_.FindSession(caller, request->session());
  if (!session.ok()) return Answer(context, session.status(), tag);
  Result<ClothList> cloths = (*session)->FindCloths(*ids);
  if (!cloths.ok()) return Answer(context, cloths.status(), tag);
  if (cloths->empty()) return Answer(context, NoCloths(), tag);
  const Status tiles = CheckTiles(*spec, cloths->size());
  if (!tiles.ok()) return Answer(context, tiles, tag);
  Result<std::shared_ptr<void>> held =
      context_.unread->Take((*session)->owner(), AnswerBytes(*spec, cloths->size()));
  if (!held.ok()) return Answer(context, held.status(), tag);
  UnaryCall* call = UnaryCall::New(tag);
  call->lease = std::move(*session);
  const auto picture = std::make_shared<PictureCall>(
      PictureCall{call, response, std::move(*cloths), spec->has_colliders,
                  spec->colouring == render::Colouring::kContact, std::move(*held)});
  const Status status =
      context_.pictures.Submit(ToJob(context_, std::move(*spec), picture, caller.deadline_us));
  if (!status.ok()) call->End(status);
  return call;
}

}  // namespace drape::api
