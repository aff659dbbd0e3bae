// drape render: a picture of the cloths of a session.
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "client/cli/commands.h"
#include "client/cli/message_json.h"
#include "client/cli/options.h"
#include "client/cli/output_file.h"
#include "client/cli/picture_flags.h"

namespace drape::cli {
namespace {

struct RenderOptions {
  SessionFlags target;
  PictureFlags picture;
  std::string path;
  bool is_json = false;
};

int Render(const RenderOptions& options) {
  OutputFile file(options.path);
  const Client client = options.target.address.Connect();
  const Session session = options.target.Attach(client);
  v1::RenderRequest request = options.picture.Request();
  options.target.Select(&request);
  v1::RenderResponse drawn = session.Render(request);
  file.Write(drawn.png());
  file.Close();
  if (options.is_json) {
    drawn.clear_png();
    auto json = nlohmann::ordered_json::parse(MessageJson(drawn));
    json.erase("png");
    std::cout << json.dump(1) << "\n";
  } else {
    std::printf("%s: %u x %u px, %d cloths, drawn by %s\n", options.path.c_str(),
                request.width_px(), request.height_px(), drawn.cloth_ids_size(),
                drawn.device().c_str());
  }
  return kDone;
}

}  // namespace

void AddRender(CLI::App& app, Action& action) {
  CLI::App* render = app.add_subcommand("render", "Draw the present state of a session's cloths");
  auto options = std::make_shared<RenderOptions>();
  options->target.AddTo(*render);
  render->add_option("picture", options->path, "The PNG file to write")
      ->check(PictureFileValidator())
      ->type_name("OUT.png")
      ->required();
  options->picture.AddTo(*render);
  render->add_flag("--json", options->is_json, "Print camera, bounds, range and steps as JSON");
  render->callback([options, &action] { action = [options] { return Render(*options); }; });
}

}  // namespace drape::cli
