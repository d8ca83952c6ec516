// The helicopter of three axes as lines in space, seen from above and from the side: its arm turns about the post (travel)
// and tips (elevation), and its body rolls about the arm (pitch). `tenbaud/recording/pose.py` draws the same in figures.

const AZIMUTH = -0.5, TILT = 0.6, SCALE = 118, CENTRE = [138, 122];
const LENGTH = 1, SPAN = 0.42, RADIUS = 0.24, MAST = 0.09, WEIGHT = -0.55;

const ring = (place) => Array.from({ length: 25 }, (_, step) => {
  const angle = (step * Math.PI) / 12;
  return [LENGTH + RADIUS * Math.cos(angle), place + RADIUS * Math.sin(angle), MAST];
});

const LINES = {
  arm: [[[WEIGHT, 0, 0], [LENGTH, 0, 0]]],
  weight: [[[WEIGHT, -0.1, -0.06], [WEIGHT, 0.1, -0.06], [WEIGHT, 0.1, 0.06], [WEIGHT, -0.1, 0.06], [WEIGHT, -0.1, -0.06]]],
  hull: [[[LENGTH, -SPAN, MAST], [LENGTH, -SPAN, 0], [LENGTH, SPAN, 0], [LENGTH, SPAN, MAST]]],
  rotors: [ring(-SPAN), ring(SPAN)],
};

function turned([x, y, z], [travel, elevation, pitch]) {
  [y, z] = [y * Math.cos(pitch) - z * Math.sin(pitch), y * Math.sin(pitch) + z * Math.cos(pitch)];
  [x, z] = [x * Math.cos(elevation) - z * Math.sin(elevation), x * Math.sin(elevation) + z * Math.cos(elevation)];
  return [x * Math.cos(travel) - y * Math.sin(travel), x * Math.sin(travel) + y * Math.cos(travel), z];
}

function seen([x, y, z]) {
  const right = x * Math.cos(AZIMUTH) - y * Math.sin(AZIMUTH), away = x * Math.sin(AZIMUTH) + y * Math.cos(AZIMUTH);
  return [CENTRE[0] + SCALE * right, CENTRE[1] - SCALE * (z * Math.cos(TILT) + away * Math.sin(TILT))];
}

// The path of some parts, such as "arm rotors", at travel, elevation and pitch.
export function pose(parts, angles) {
  return parts.split(" ").flatMap((part) => LINES[part]).map((points) =>
    `M${points.map((point) => seen(turned(point, angles)).map((value) => value.toFixed(1)).join(" ")).join("L")}`).join("");
}
