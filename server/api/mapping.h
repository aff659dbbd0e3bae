// From plain structs to drape.v1 messages. Pure; every frame shift in double precision.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drape/v1/cloths.pb.h"
#include "drape/v1/render.pb.h"
#include "drape/v1/session.pb.h"
#include "drape/v1/step.pb.h"
#include "server/render/picture_queue.h"
#include "server/scheduler/step_work.h"
#include "server/session/session.h"
#include "server/session/session_registry.h"

namespace drape::api {

v1::Session ToProto(const SessionView& session);
// `start` as in ClothCopy; may be null.
v1::ClothShape ToProto(const SceneModel& model, const std::string& plan, const ClearStart* start,
                       const std::optional<ElasticLimit>& elastic_limit);
v1::Environment EnvironmentToProto(const ClothParameters& parameters);
v1::Cloth ToProto(const ClothRecord& record);
v1::StepReport ToProto(ClothId id, uint64_t step, const StepReport& report,
                       const WarningCounters& warnings);
// Everything but the states. `cloths` in the order of the outcome.
v1::StepResponse ToProto(const ClothList& cloths, const StepOutcome& outcome);
v1::Camera ToProto(const render::Camera& camera);
// `cloths` in the order of the picture.
v1::RenderResponse ToProto(const ClothList& cloths, render::DrawnPicture picture);

}  // namespace drape::api
