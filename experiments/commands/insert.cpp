#include "experiments/commands/insert.hpp"

#include "experiments/applications/insert.hpp"
#include "experiments/applications/light_choice.hpp"
#include "experiments/applications/run_report.hpp"
#include "experiments/applications/run_results.hpp"
#include "experiments/commands/cli.hpp"
#include "experiments/commands/method_option.hpp"
#include "experiments/commands/record_json.hpp"
#include "experiments/commands/sample_options.hpp"
#include "host/io/data_files.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace {

/// Each --at or --at-point starts an object; what follows describes it.
InsertedObject& latest(InsertOptions& options, const std::string& option) {
  if (options.objects.empty())
    throw usage_error("of which object? Each starts with its place", option, "no place before it",
                      "--at or --at-point first");
  return options.objects.back();
}

template <std::size_t N>
std::array<double, N> numbers(const std::string& text, const std::string& option) {
  const std::vector<double> list = read_numbers(text, option, N);
  std::array<double, N> values{};
  std::copy(list.begin(), list.end(), values.begin());
  return values;
}

double unit(const std::string& text, const std::string& option) {
  double value = 0;
  read_value(text, option, value);
  if (!(value >= 0 && value <= 1)) throw usage_error("out of range", option, text, "0 to 1");
  return value;
}

void check(const InsertOptions& options) {
  for (const InsertedObject& o : options.objects) {
    if (o.radius.has_value() == !o.mesh.empty())
      throw usage_error("an object is a ball or a mesh", "--radius, --mesh", o.radius ? "both" : "neither",
                        "one of them");
    if (!o.mesh.empty() && !o.size)
      throw usage_error("a mesh needs a size", "--mesh", o.mesh.string(), "--size METRES");
    if (o.mesh.empty() && o.size)
      throw usage_error("is of a mesh", "--size", fmt::format("{}", *o.size),
                        "--radius alone, or --mesh beside --size");
  }
}

}  // namespace

void add_insert_command(CommandLine& line) {
  const auto options = std::make_shared<InsertOptions>();
  const auto samples = std::make_shared<SampleOptions>();
  const auto set = [options](const std::string& name, auto apply) {
    return [options, name, apply](const std::string& text) { apply(latest(*options, name), text); };
  };
  Command command = line.add("insert", "Put balls and meshes into the photograph of a run");
  command.argument("RUN", "Folder that invert wrote", options->run)
      .option("--at", "X,Y", "Starts an object that rests on the surface at this pixel",
              [options](const std::string& text) { options->objects.emplace_back().at = numbers<2>(text, "--at"); })
      .option("--at-point", "X,Y,Z", "Starts an object at a point in camera metres: a ball's centre, a mesh's foot",
              [options](const std::string& text) {
                options->objects.emplace_back().at_point = numbers<3>(text, "--at-point");
              })
      .option("--radius", "METRES", "The object is a ball",
              set("--radius", [](InsertedObject& o, const std::string& t) { o.radius = numbers<1>(t, "--radius")[0]; }))
      .option("--mesh", "FILE.glb", "The object is a mesh",
              set("--mesh", [](InsertedObject& o, const std::string& t) { o.mesh = found_data(t); }))
      .option("--size", "METRES", "Longest side of the mesh",
              set("--size", [](InsertedObject& o, const std::string& t) { o.size = numbers<1>(t, "--size")[0]; }))
      .option("--albedo", "R,G,B", "Linear base colour",
              set("--albedo",
                  [](InsertedObject& o, const std::string& t) {
                    o.albedo = numbers<3>(t, "--albedo");
                    for (const double a : o.albedo)
                      if (!(a >= 0 && a <= 1)) throw usage_error("out of range", "--albedo", t, "0 to 1");
                  }),
              "0.9,0.9,0.9")
      .option("--roughness", "R", "Perceptual roughness",
              set("--roughness", [](InsertedObject& o, const std::string& t) { o.roughness = unit(t, "--roughness"); }),
              "0.1")
      .option("--metallic", "M", "1 for metal",
              set("--metallic", [](InsertedObject& o, const std::string& t) { o.metallic = unit(t, "--metallic"); }),
              "1")
      .option("--bounces", "N", "How many scatterings at objects are followed", options->bounces)
      .option("--out", "DIR", "Where composite.exr and composite.png go; default: the run folder", options->out)
      .flag("--force", "Replace files of these names that no insertion wrote", options->force);
  add_sample_options(command, options->render, *samples, "what the objects' pixels show");
  command.light(lights_to_choose(), options->lit_by.weights, options->lit_by.lamps)
      .common({Common::Device, Common::Seed, Common::Spp, Common::Gemm, Common::Json, Common::Quiet})
      .notes(
          "Options after --at describe that object. Prints where the composite lies.\n"
          "  clerestory insert runs/invert/office --at 330,400 --radius 0.2 --roughness 0.02 --at 200,420 --mesh "
          "bunny.glb --size 0.4\n" +
          lights_note());
  command.run([options, samples](const CommonOptions& common) {
    check(*options);
    if (options->bounces < 1 || options->bounces > 4)
      throw usage_error("out of range", "--bounces", fmt::format("{}", options->bounces), "1 to 4");
    options->device = common.device, options->gemm = common.gemm, options->command = common.command;
    options->render.seed = render_seed(common), options->json = common.json.value_or("");
    take_method(common, options->render, options->lit_by);
    options->goal = take_samples(common, *samples, options->render);
    catch_interrupts();
    insert(*options);
    const std::filesystem::path out = options->out.empty() ? options->run : options->out;
    refresh_run_report(options->run, out);
    print_result(common, out / "composite.png",
                 record_json({{"composite", out / "composite.exr"}}, out / kInsertRecord));
  });
}

}  // namespace clerestory
