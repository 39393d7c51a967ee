// Orthographic view of closed shells: WebGL 2, or triangles sorted by depth on a plain canvas.

const VERTEX = `#version 300 es
in vec3 place; uniform mat4 view; uniform float lift; out vec3 at;
void main() { at = place; gl_Position = view * vec4(place.xy, place.z + lift, 1.0); }`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec3 at; uniform vec4 plane; uniform vec4 colour; uniform vec3 light; uniform bool lit; out vec4 shown;
void main() {
  if (dot(plane.xyz, at) > plane.w) discard;
  float shade = 1.0;
  if (lit) {
    vec3 normal = normalize(cross(dFdx(at), dFdy(at)));
    shade = 0.62 + 0.38 * abs(dot(normal, light));
  }
  shown = vec4(colour.rgb * shade, 1.0) * colour.a;
}`;
const LIGHT = [0.35, -0.45, 0.82];

// view: turn and tilt [rad], scale [px/mm], centre [mm]; the rows of the turned axes: right, up, away
function axes(view) {
  const [c, s, ct, st] = [Math.cos(view.turn), Math.sin(view.turn), Math.cos(view.tilt), Math.sin(view.tilt)];
  return [[c, -s, 0], [s * st, c * st, ct], [s * ct, c * ct, -st]];
}
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

// The scale at which a box fits into a picture of width x height pixels
function fitting(view, low, high, width, height) {
  const half = low.map((v, k) => (high[k] - v) / 2);
  const reach = axes(view).map(row => row.reduce((sum, v, k) => sum + Math.abs(v) * half[k], 0));
  return 0.9 * Math.min(width / 2 / reach[0], height / 2 / reach[1]);
}

function matrix(view, width, height, deep) {
  const rows = axes(view), scale = [2 * view.scale / width, 2 * view.scale / height, 1 / deep];
  const out = new Float32Array(16);
  rows.forEach((row, r) => {
    row.forEach((v, c) => { out[4 * c + r] = v * scale[r]; });
    out[12 + r] = -dot(row, view.centre) * scale[r];
  });
  out[15] = 1;
  return out;
}

function solidPainter(canvas) {
  const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) return null;
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return null;
  const named = Object.fromEntries(["view", "lift", "plane", "colour", "light", "lit"].map(
    name => [name, gl.getUniformLocation(program, name)]));
  const buffers = new WeakMap();
  function loaded(shell) {
    if (!buffers.has(shell)) {
      const array = gl.createVertexArray(), [faces, lines] = [shell.triangles, shell.edges].map(content => {
        const buffer = gl.createBuffer();
        gl.bindVertexArray(null);
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
        gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, content, gl.STATIC_DRAW);
        return buffer;
      });
      gl.bindVertexArray(array);
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, shell.vertices, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(0);
      gl.vertexAttribPointer(gl.getAttribLocation(program, "place"), 3, gl.FLOAT, false, 0, 0);
      buffers.set(shell, { array, faces, lines });
    }
    return buffers.get(shell);
  }
  return function paint(shells, view, plane, colours, ground, ink, deep) {
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...ground, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.enable(gl.CULL_FACE);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.useProgram(program);
    gl.uniformMatrix4fv(named.view, false, matrix(view, canvas.width, canvas.height, deep));
    gl.uniform4fv(named.plane, plane);
    gl.uniform3fv(named.light, LIGHT);
    const line = Math.min(Math.max((view.scale / view.pixels - 3) / 14, 0), 1) * 0.75;
    for (const shell of shells) {
      const { array, faces, lines } = loaded(shell);
      gl.bindVertexArray(array);
      gl.uniform1f(named.lift, shell.lift);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, faces);
      // Inner sides are seen only where the plane has opened a body: flat in its colour, before all else at their
      // depth, they are the cut face
      for (const [side, lit, nearer] of [[gl.BACK, 1, 1], [gl.FRONT, 0, -1]]) {
        gl.cullFace(side);
        gl.polygonOffset(nearer, nearer);
        gl.uniform1i(named.lit, lit);
        gl.uniform4f(named.colour, ...colours[shell.body], 1);
        gl.drawElements(gl.TRIANGLES, shell.triangles.length, gl.UNSIGNED_INT, 0);
      }
      if (line > 0) {
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, lines);
        gl.uniform1i(named.lit, 0);
        gl.uniform4f(named.colour, ...ink, line);
        gl.drawElements(gl.LINES, shell.edges.length, gl.UNSIGNED_INT, 0);
      }
    }
  };
}

const MOST_FACES = 60000;

function flatPainter(canvas) {
  const pen = canvas.getContext("2d");
  return function paint(shells, view, plane, colours, ground) {
    const css = (rgb, shade) => `rgb(${rgb.map(v => Math.round(255 * v * shade)).join()})`;
    pen.fillStyle = css(ground, 1);
    pen.fillRect(0, 0, canvas.width, canvas.height);
    const [right, up, away] = axes(view), faces = [];
    let left = MOST_FACES;
    for (const shell of shells) {
      const v = shell.vertices, t = shell.triangles;
      const corner = k => [v[3 * k], v[3 * k + 1], v[3 * k + 2]];
      for (let k = 0; k < t.length && left > 0; k += 3, left--) {
        const p = [corner(t[k]), corner(t[k + 1]), corner(t[k + 2])];
        if (p.every(q => dot(plane, q) > plane[3])) continue;
        const a = p[1].map((x, n) => x - p[0][n]), b = p[2].map((x, n) => x - p[0][n]);
        const n = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        if (dot(n, away) >= 0) continue;
        const shade = 0.62 + 0.38 * Math.abs(dot(n, LIGHT)) / Math.hypot(...n);
        const seen = p.map(q => q.map((x, m) => x - view.centre[m] + (m === 2 ? shell.lift : 0)));
        const z = seen.reduce((sum, q) => sum + dot(away, q), 0) / 3;
        faces.push([z, seen.map(q => [canvas.width / 2 + view.scale * dot(right, q),
          canvas.height / 2 - view.scale * dot(up, q)]), css(colours[shell.body], shade)]);
      }
    }
    faces.sort((one, other) => other[0] - one[0]);
    for (const [, points, colour] of faces) {
      pen.fillStyle = pen.strokeStyle = colour;
      pen.beginPath();
      points.forEach(p => pen.lineTo(...p));
      pen.closePath();
      pen.fill();
      pen.stroke();
    }
  };
}
