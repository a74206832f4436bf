// Cams: their figures, and a moving picture of each cam with its pitch curve and its follower.
function camsSection() {
  const rows = model.cams.map((cam, k) => ({ ...summary.cams[cam.name], ...cam, k })),
    grid = h("div.charts");
  if (!rows.length) return;
  const column = (name, key, means, words = figureWords) => ({
    name,
    means,
    text: (
      { figures },
    ) => (figures[key] && figures[key].value !== null ? words(figures[key]) + errorWords(figures[key]) : ""),
  });
  const places = (name, key, means) => ({
    name,
    means,
    wraps: true,
    text: (each) => contactWords(each[key]).replace(/^\d+/, each.counts[key]),
  });
  section(
    "cams",
    "Cams",
    "Cams",
    soft(
      "From the motion of the followers as rigid links. Forces act along the contact normal, without " +
        "friction; a negative force means that the cam would have to pull.",
    ),
    table(rows, [
      { name: "Cam", text: (each) => each.name },
      {
        name: "follower",
        text: (each) =>
          `${each.follower}, ${
            each.roller ? (each.radius ? `roller of ${quantity(each.radius, "m")}` : "knife edge") : "flat face"
          }`,
      },
      { name: "speed", text: (each) => rpmWords(each.speed) },
      column(
        "pressure angle",
        "cam_pressure_angle",
        "between the normal of the contact and the way in which the drive moves it, the largest",
        figureAngle,
      ),
      where("at", ({ figures }) => figures.cam_pressure_angle),
      column("pitch curve, least radius", "cam_pitch_radius"),
      column(
        "bulge, least radius",
        "cam_radius",
        "of curvature of the profile where it bulges; negative where it would have to go back on itself",
      ),
      column(
        "hollow, least radius",
        "cam_hollow_radius",
        "of curvature of the profile where it is hollow: no cutter or stone may be larger",
      ),
      column("distance from the shaft", "cam_least_distance", "least of the profile"),
      column("to", "cam_distance"),
      column("within the face", "cam_face_margin", "how far the contact stays within the ends of the face"),
      places("undercut at", "undercut", "positions with an undercut profile"),
      {
        name: "cut by",
        means: "depth by which the follower cuts into the profile at another place",
        text: (each) => (each.cut.value > 1e-9 ? figureWords(each.cut) : ""),
      },
    ], "Form of the cams"),
    table(rows, [
      { name: "Cam", text: (each) => each.name },
      column("largest force", "cam_force"),
      where("at", ({ figures }) => figures.cam_force),
      column("least force", "cam_least_force", "negative if contact is lost"),
      column("spring that keeps contact", "cam_preload", "additional effort along the drive"),
      column(
        "lag of the drive",
        "cam_lag",
        "by which the follower, as it bends, is off on its cam: the cam holds the contact, the figures of " +
          "the page hold the drive",
        figureAngle,
      ),
      column("pressure", "cam_pressure", "of the contact, by Hertz"),
      column("torque of the shaft", "cam_torque"),
      places("contact lost at", "contact_lost"),
    ], "Contact of the cams"),
    h("div.cams", rows.map(camPicture)),
    grid,
  );
  const curves = (key, factor = 1) =>
    rows.map((each) => ({ name: each.name, colour: each.k, values: (i) => factor * row(key, each.k)[i] }));
  chart(grid, "Pressure angle of the cams", "deg", curves("cam_pressure_angle", 180 / Math.PI));
  chart(grid, "Force of the cams on their followers", "N", curves("cam_force"));
  chart(grid, "Torque of the cams' shafts", "N m", curves("cam_torque"));
  if (rows.some(({ figures }) => figures.cam_pressure)) {
    chart(grid, "Pressure of the contacts", "Pa", curves("cam_pressure"));
  }
}

// SVG path through points in the axes of a cam, y downwards.
const outlineOf = (places) => {
  const known = places.filter(([x, y]) => x !== null && y !== null);
  return `M${known.map(([x, y]) => `${x} ${-y}`).join("L")}Z`;
};

// The cam at the current instant, in ground axes with the shaft at the origin, with its follower and the normal.
function camPicture(cam) {
  const body = model.marks.find(({ x_axis: number }) => number === cam.k),
    sizes = cam.flanks.flat().map(size).filter(isFinite);
  const reach = Math.max(...sizes, ...cam.pitch.map(size), 1e-12), faceEnds = cam.face ?? [];
  const most = Math.max(body.radius[1], reach + cam.radius) * 1.08;
  const turning = s(
    "g",
    s("path.body", { "fill-rule": "evenodd", d: markPath(body, 1, 0) }),
    cam.pitch.length ? s("path.pitch", { d: outlineOf(cam.pitch) }) : null,
    s("path.mark", { d: `M0 0H${0.5 * Math.min(...sizes, reach)}` }),
  );
  const roller = cam.roller ? s("circle.roller", { r: Math.max(cam.radius, 0.008 * most) }) : null,
    face = cam.face ? s("path.roller") : null;
  const svg = s(
    "svg",
    {
      viewBox: `${-most} ${-most} ${2 * most} ${2 * most}`,
      role: "img",
      "aria-label": `The cam ${cam.name} with its follower ${cam.follower}`,
      class: "cam",
    },
    turning,
    s("circle.shaft", { r: 0.02 * most }),
    face,
    roller,
  );
  const place = (local, i) => plus(placeOf(cam.link, local, i), scaled(-1, cam.centre));
  const update = (i) => {
    turning.setAttribute("transform", markTurn([0, 0], vector("x_axis", cam.k, i)));
    if (roller) {
      const [px, py] = place(cam.roller, i);
      roller.setAttribute("cx", px || 0);
      roller.setAttribute("cy", -py || 0);
    }
    if (face) {
      face.setAttribute(
        "d",
        faceEnds.map((end, n) => {
          const [px, py] = place(end, i);
          return `${n ? "L" : "M"}${px || 0} ${-py || 0}`;
        }).join(""),
      );
    }
  };
  follow(update);
  update(instant.position);
  const legend = cam.roller
    ? "profile, dashed the pitch curve, the roller as it stands"
    : "profile, the face as it stands";
  return h(
    "figure.chart",
    h(
      "figcaption",
      h("h3", `Cam ${cam.name}`),
      h("div.downloads", button("SVG", () => downloadSvg(`cam ${cam.name}`, camDrawing(cam, most)))),
    ),
    soft(legend),
    svg,
  );
}

// At true size in mm, in its initial position.
function camDrawing(cam, most) {
  const wide = (2000 * most).toFixed(4), style = "fill:none;stroke:#000";
  const picture = s(
    "svg",
    {
      xmlns: SVG,
      width: `${wide}mm`,
      height: `${wide}mm`,
      viewBox: `${-most} ${-most} ${2 * most} ${2 * most}`,
      style,
      "stroke-width": most / 500,
    },
    cam.flanks.map((flank) => s("path", { d: outlineOf(flank) })),
    cam.pitch.length ? s("path", { d: outlineOf(cam.pitch), "stroke-dasharray": most / 40 }) : null,
    s("circle", { r: 0.02 * most }),
  );
  return picture;
}

partSections.push(camsSection);
