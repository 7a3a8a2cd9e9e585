<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="zh_CN" sourcelanguage="en">
<context>
    <name>About</name>
    <message>
        <source>About Lightpen</source>
        <translation>关于 Lightpen</translation>
    </message>
    <message>
        <source>Calibrates the probe tip of a light pen.</source>
        <translation>标定光笔的测头。</translation>
    </message>
    <message>
        <source>Lightpen: MIT licence. Qt and PySide6: LGPL 3. Fonts: cut from Noto Sans and Noto Sans CJK, SIL Open Font License 1.1.</source>
        <translation>Lightpen：MIT 许可证。Qt 和 PySide6：LGPL 3。字体：截取自 Noto Sans 和 Noto Sans CJK，SIL 开放字体许可证 1.1。</translation>
    </message>
</context>
<context>
    <name>ActionBar</name>
    <message>
        <source>Back</source>
        <translation>上一步</translation>
    </message>
</context>
<context>
    <name>ArchivePanel</name>
    <message>
        <source>Check the archive</source>
        <translation>检查档案库</translation>
    </message>
    <message>
        <source>Take up another station&apos;s...</source>
        <translation>导入另一工位的条目...</translation>
    </message>
    <message>
        <source>Save...</source>
        <translation>保存...</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>取消</translation>
    </message>
    <message>
        <source>Entries shown (CSV)...</source>
        <translation>所列条目 (CSV)...</translation>
    </message>
    <message>
        <source>Entries shown (JSON)...</source>
        <translation>所列条目 (JSON)...</translation>
    </message>
    <message>
        <source>All, for another station...</source>
        <translation>全部条目，供另一工位使用...</translation>
    </message>
    <message>
        <source>Something else is under way.</source>
        <translation>另一项操作正在进行。</translation>
    </message>
    <message>
        <source>Read every entry, record, result and image, and compare</source>
        <translation>读取并核对每个条目、记录、结果和图像</translation>
    </message>
    <message>
        <source>For other programs, or for another station</source>
        <translation>供其他程序或另一工位使用</translation>
    </message>
    <message>
        <source>Copy the entries of a file that was saved at another station</source>
        <translation>复制另一工位所保存文件中的条目</translation>
    </message>
    <message>
        <source>The server does not have all entries. They stay here, and are delivered when it answers. {0}</source>
        <translation>服务器尚缺部分条目。条目保存在本机，待服务器恢复响应后送达。{0}</translation>
    </message>
    <message>
        <source>The server has all entries.</source>
        <translation>服务器已收到全部条目。</translation>
    </message>
    <message>
        <source>Entries are being delivered to the server.</source>
        <translation>正在向服务器送交条目。</translation>
    </message>
    <message>
        <source>{0} more were found.</source>
        <translation>另外还发现 {0} 处。</translation>
    </message>
    <message>
        <source>Not checked since the program was started.</source>
        <translation>程序启动后尚未检查。</translation>
    </message>
    <message>
        <source>Something was changed. {0} entries and {1} files were read.</source>
        <translation>发现更改。已读取 {0} 个条目和 {1} 个文件。</translation>
    </message>
    <message>
        <source>No change was found in {0} entries and {1} files.</source>
        <translation>在 {0} 个条目和 {1} 个文件中未发现更改。</translation>
    </message>
</context>
<context>
    <name>ArticulationFinding</name>
    <message>
        <source>Cone by each posture / mm</source>
        <translation>各姿态测得的锥孔 / mm</translation>
    </message>
    <message>
        <source>Spread / mm</source>
        <translation>离散 / mm</translation>
    </message>
    <message>
        <source>In the form of ISO 10360-12: five postures of five touches.</source>
        <translation>按 ISO 10360-12 的形式：五个姿态，各五次接触。</translation>
    </message>
    <message>
        <source>Location error {0} mm, {1} mm to be expected.</source>
        <translation>位置误差 {0} mm，预期 {1} mm。</translation>
    </message>
</context>
<context>
    <name>ArticulationStrip</name>
    <message>
        <source>Touch the cone five times in each of five postures</source>
        <translation>以五个姿态各接触锥孔五次</translation>
    </message>
</context>
<context>
    <name>AssumptionsDialog</name>
    <message>
        <source>Assumptions of the station</source>
        <translation>工位的假定值</translation>
    </message>
    <message>
        <source>Standard uncertainties (k = 1) where the files of camera and LEDs state none. The next swing uses them, and its result marks what rests on them.</source>
        <translation>内参文件和 LED 文件未给出不确定度时所采用的标准不确定度（k = 1）。下一次摆动将采用这些值，结果中会标明依据假定的部分。</translation>
    </message>
    <message>
        <source>not measured</source>
        <translation>未测量</translation>
    </message>
    <message>
        <source>Focal length; the rest of the camera goes with it</source>
        <translation>焦距；相机其余参数的不确定度按比例随之给定</translation>
    </message>
    <message>
        <source>Scale of the LEDs</source>
        <translation>LED 坐标的尺度</translation>
    </message>
    <message>
        <source>Ball and cone, as they are not quite round</source>
        <translation>测球和锥孔的圆度误差</translation>
    </message>
    <message>
        <source>LED centres, by what does not average out</source>
        <translation>LED 中心中不能被平均的误差</translation>
    </message>
    <message>
        <source>Temperature of the pen during the swing</source>
        <translation>摆动时光笔的温度</translation>
    </message>
    <message>
        <source>Uncertainty of this temperature</source>
        <translation>该温度的不确定度</translation>
    </message>
    <message>
        <source>How much warmer than at its measurement, not measured</source>
        <translation>比测量 LED 时高出的温度（未测量时）</translation>
    </message>
    <message>
        <source>Thermal expansion of the pen</source>
        <translation>光笔的热膨胀系数</translation>
    </message>
    <message>
        <source>Usual: {0}.</source>
        <translation>通常：{0}。</translation>
    </message>
</context>
<context>
    <name>AssumptionsPanel</name>
    <message>
        <source>Where files say nothing</source>
        <translation>文件未说明的内容</translation>
    </message>
    <message>
        <source>The usual uncertainties are assumed.</source>
        <translation>采用通常的不确定度。</translation>
    </message>
    <message>
        <source>Uncertainties of this station are assumed.</source>
        <translation>采用本工位设定的不确定度。</translation>
    </message>
    <message>
        <source>Change</source>
        <translation>更改</translation>
    </message>
    <message>
        <source>Change what is assumed</source>
        <translation>更改假定值</translation>
    </message>
    <message>
        <source>Focal length, scale, warmth, ball and cone: how uncertain each is where no file says it.</source>
        <translation>焦距、尺度、温度、测球和锥孔：文件未说明时各自的不确定度。</translation>
    </message>
</context>
<context>
    <name>BoardWindow</name>
    <message>
        <source>Images of the board</source>
        <translation>标定板的图像</translation>
    </message>
    <message>
        <source>Calibrating: {0:.0%}</source>
        <translation>正在标定：{0:.0%}</translation>
    </message>
    <message>
        <source>{0}: {1:.4f} px, by the others {2:.4f} px</source>
        <translation>{0}：{1:.4f} px，由其他视图得 {2:.4f} px</translation>
    </message>
    <message>
        <source>Calibrated.</source>
        <translation>标定完成。</translation>
    </message>
    <message>
        <source>Save the camera file</source>
        <translation>保存内参文件</translation>
    </message>
    <message>
        <source>Saved and in use: {0}</source>
        <translation>已保存并使用：{0}</translation>
    </message>
    <message>
        <source>Calibrate this camera</source>
        <translation>标定此相机</translation>
    </message>
    <message>
        <source>Board</source>
        <translation>标定板</translation>
    </message>
    <message>
        <source>Kind, columns x rows, lengths in mm: chessboard:11x8:20 (inner corners, square), charuco:12x9:20:15:DICT_5X5_100 (squares, square, marker), circles:9x7:20:10 (distance, diameter), asymmetric-circles:4x11:20:10</source>
        <translation>类型、列数 x 行数、长度（mm）：chessboard:11x8:20（内角点、格边长），charuco:12x9:20:15:DICT_5X5_100（格数、格边长、标记边长），circles:9x7:20:10（圆心距、直径），asymmetric-circles:4x11:20:10</translation>
    </message>
    <message>
        <source>From a folder...</source>
        <translation>从文件夹...</translation>
    </message>
    <message>
        <source>Calibrate</source>
        <translation>标定</translation>
    </message>
    <message>
        <source>Views, the worst first</source>
        <translation>视图（最差的在前）</translation>
    </message>
    <message>
        <source>Residuals</source>
        <translation>残差</translation>
    </message>
    <message>
        <source>Uncertainty</source>
        <translation>不确定度</translation>
    </message>
    <message>
        <source>How uncertain the intrinsics leave where a point is seen, over the image: standard uncertainty, px.</source>
        <translation>由内参引起的成像位置的标准不确定度在整幅图像上的分布，单位 px。</translation>
    </message>
    <message>
        <source>Leave out and calibrate again</source>
        <translation>剔除并重新标定</translation>
    </message>
    <message>
        <source>Save and use...</source>
        <translation>保存并使用...</translation>
    </message>
    <message>
        <source>Start, and hold the board as the outline shows.</source>
        <translation>开始后，请按轮廓所示放置标定板。</translation>
    </message>
    <message>
        <source>Stop</source>
        <translation>停止</translation>
    </message>
    <message>
        <source>Start</source>
        <translation>开始</translation>
    </message>
    <message>
        <source>Views kept: {0}</source>
        <translation>已保留的视图：{0}</translation>
    </message>
    <message>
        <source>At least {0} views are needed.</source>
        <translation>至少需要 {0} 幅视图。</translation>
    </message>
    <message>
        <source>Calibrate first.</source>
        <translation>请先标定。</translation>
    </message>
    <message>
        <source>Choose a view.</source>
        <translation>请选择一幅视图。</translation>
    </message>
    <message>
        <source>The board is not seen.</source>
        <translation>看不到标定板。</translation>
    </message>
    <message>
        <source>Hold it still.</source>
        <translation>请保持静止。</translation>
    </message>
    <message>
        <source>Keep it still.</source>
        <translation>请继续保持静止。</translation>
    </message>
    <message>
        <source>Kept. Move the board into the outline.</source>
        <translation>已保留。请把标定板移到轮廓处。</translation>
    </message>
    <message>
        <source>There is such a view already. Move the board into the outline.</source>
        <translation>已有类似的视图。请把标定板移到轮廓处。</translation>
    </message>
    <message>
        <source>Residuals {0:.4f} px rms, in views left out {1:.4f} px</source>
        <translation>残差 {0:.4f} px（均方根），留出视图 {1:.4f} px</translation>
    </message>
    <message>
        <source>Projection uncertain by {0:.3f} px, at worst {1:.3f} px</source>
        <translation>投影不确定度 {0:.3f} px，最差处 {1:.3f} px</translation>
    </message>
</context>
<context>
    <name>CameraPage</name>
    <message>
        <source>Camera</source>
        <translation>相机</translation>
    </message>
    <message>
        <source>See that the LEDs are bright and sharp, that the intrinsics are those of this camera, and that nothing else shines.</source>
        <translation>确认 LED 明亮清晰，内参属于这台相机，并且没有其他光源。</translation>
    </message>
    <message>
        <source>The camera is lost. It is looked for until it is back.</source>
        <translation>相机连接中断。程序会持续查找，直到恢复。</translation>
    </message>
    <message>
        <source>Continue to the LEDs</source>
        <translation>下一步：LED</translation>
    </message>
    <message>
        <source>No camera is open.</source>
        <translation>相机未打开。</translation>
    </message>
    <message>
        <source>stray</source>
        <translation>杂散光</translation>
    </message>
    <message>
        <source>A swing is under way. Another source ends it; other intrinsics and another mask count from the next swing on.</source>
        <translation>摆动正在进行。更换来源会结束摆动；新的内参和屏蔽从下一次摆动起生效。</translation>
    </message>
</context>
<context>
    <name>CameraSwitch</name>
    <message>
        <source>Camera {0}</source>
        <translation>相机 {0}</translation>
    </message>
</context>
<context>
    <name>CapabilityRow</name>
    <message>
        <source>Capability: tolerance</source>
        <translation>量具能力：公差</translation>
    </message>
    <message>
        <source>Tolerance of a coordinate</source>
        <translation>单个坐标的公差</translation>
    </message>
    <message>
        <source>no study</source>
        <translation>不评定</translation>
    </message>
    <message>
        <source>Tip by a better instrument</source>
        <translation>由更精密仪器测得的测头中心</translation>
    </message>
    <message>
        <source>{0} of the reference</source>
        <translation>参考值的 {0}</translation>
    </message>
    <message>
        <source>Capable: all are {0} or more.</source>
        <translation>能力足够：各值均不小于 {0}。</translation>
    </message>
    <message>
        <source>Not capable: {0} is asked for.</source>
        <translation>能力不足：要求不小于 {0}。</translation>
    </message>
    <message>
        <source>A study takes {0} to 50 repeats; these are {1}.</source>
        <translation>评定需要 {0} 至 50 次重复，目前为 {1} 次。</translation>
    </message>
</context>
<context>
    <name>DataFolderPanel</name>
    <message>
        <source>Data folder</source>
        <translation>数据文件夹</translation>
    </message>
    <message>
        <source>Open folder</source>
        <translation>打开文件夹</translation>
    </message>
    <message>
        <source>Open the data folder</source>
        <translation>打开数据文件夹</translation>
    </message>
    <message>
        <source>Swings and results are kept here.</source>
        <translation>摆动记录和结果保存在这里。</translation>
    </message>
    <message>
        <source>Change...</source>
        <translation>更改...</translation>
    </message>
    <message>
        <source>Choose another data folder</source>
        <translation>选择其他数据文件夹</translation>
    </message>
    <message>
        <source>Keep swings and results elsewhere from the next start on.</source>
        <translation>从下次启动起，将摆动记录和结果保存到其他位置。</translation>
    </message>
    <message>
        <source>Other windows of the program that use this folder: {0}. All of them put their tips in force here.</source>
        <translation>使用此文件夹的其他程序窗口：{0} 个。它们接受的测头都在这里生效。</translation>
    </message>
</context>
<context>
    <name>DateField</name>
    <message>
        <source>A day such as {0}; empty for any.</source>
        <translation>日期，例如 {0}；留空则不限。</translation>
    </message>
</context>
<context>
    <name>Demo</name>
    <message>
        <source>The demo ends here: there is no tip to accept.</source>
        <translation>演示到此结束：没有可接受的测头结果。</translation>
    </message>
    <message>
        <source>Demo: station, pen, tip and cone are named.</source>
        <translation>演示：填写工位、光笔、测头和锥孔。</translation>
    </message>
    <message>
        <source>Demo: the simulated camera sends images; exposure, focus and the intrinsics are checked.</source>
        <translation>演示：模拟相机送来图像；检查曝光、对焦和内参。</translation>
    </message>
    <message>
        <source>Demo: the LEDs of the file are compared with those in the image.</source>
        <translation>演示：将文件中的 LED 与图像中的 LED 比较。</translation>
    </message>
    <message>
        <source>Demo: the simulated operator seats the tip and follows the arrow. No key is pressed from here to the verdict.</source>
        <translation>演示：模拟操作员将测头就位并跟随箭头。从这里到得出结论，无需按任何键。</translation>
    </message>
    <message>
        <source>Demo: the tip, what it is worth, and why.</source>
        <translation>演示：测头结果、可信程度及其依据。</translation>
    </message>
    <message>
        <source>The tip is accepted, and nothing of the demo is kept.</source>
        <translation>测头已接受，演示的内容不会保留。</translation>
    </message>
    <message>
        <source>That was the demo. Look around as long as you like; nothing of it is kept. Start the program without the demo to calibrate a tip.</source>
        <translation>演示结束。您可以随意查看；演示数据不会保留。要标定测头，请不带演示启动程序。</translation>
    </message>
</context>
<context>
    <name>DriftFinding</name>
    <message>
        <source>Moves of the witness / mm</source>
        <translation>监视点的位移 / mm</translation>
    </message>
    <message>
        <source>A cone that stands still is the witness: what it moves by from one visit to the next counts in U of what is touched in between.</source>
        <translation>以固定不动的锥孔作为监视点：相邻两次触测之间它的位移计入其间所测内容的 U。</translation>
    </message>
    <message>
        <source>U of {0} / mm</source>
        <translation>{0} 的 U / mm</translation>
    </message>
    <message>
        <source>Visit {0}</source>
        <translation>第 {0} 次</translation>
    </message>
    <message>
        <source>Standard uncertainty by it along u, v, w: {0} mm.</source>
        <translation>由此引起的 u、v、w 方向标准不确定度：{0} mm。</translation>
    </message>
</context>
<context>
    <name>DriftStrip</name>
    <message>
        <source>Touch the cone before, between and after the other tasks</source>
        <translation>在其他任务之前、之间和之后触测锥孔</translation>
    </message>
</context>
<context>
    <name>DuePanel</name>
    <message>
        <source>Days in force at most</source>
        <translation>最长有效天数</translation>
    </message>
    <message>
        <source>Swings of its pen at most</source>
        <translation>其光笔的最多摆动次数</translation>
    </message>
    <message>
        <source>any number</source>
        <translation>不限</translation>
    </message>
    <message>
        <source>A supervisor lays it down, at Start: All limits...</source>
        <translation>由主管在“开始”步骤的“所有限值...”中规定。</translation>
    </message>
    <message>
        <source>Each swing, with whatever tip, wears the seat of all tips.</source>
        <translation>无论使用哪个测头，每次摆动都会磨损所有测头共用的安装座。</translation>
    </message>
    <message>
        <source>{0} of {1} tips in force at this station are due.</source>
        <translation>本工位的有效测头中，{1} 个里有 {0} 个已到期。</translation>
    </message>
    <message>
        <source>Calibrated</source>
        <translation>标定日期</translation>
    </message>
    <message>
        <source>Due</source>
        <translation>到期</translation>
    </message>
    <message>
        <source>Swings since</source>
        <translation>此后摆动次数</translation>
    </message>
    <message>
        <source>Swings left</source>
        <translation>剩余摆动次数</translation>
    </message>
    <message>
        <source>State</source>
        <translation>状态</translation>
    </message>
    <message>
        <source>DUE</source>
        <translation>已到期</translation>
    </message>
    <message>
        <source>in time</source>
        <translation>未到期</translation>
    </message>
</context>
<context>
    <name>EntryPanel</name>
    <message>
        <source>Put this tip in force again? It becomes a new entry; the tip in force now is kept.</source>
        <translation>使该测头数据重新生效？这将成为一个新条目；当前有效的数据仍然保留。</translation>
    </message>
    <message>
        <source>Reason</source>
        <translation>理由</translation>
    </message>
    <message>
        <source>Put in force</source>
        <translation>使其生效</translation>
    </message>
    <message>
        <source>Leave it</source>
        <translation>不更改</translation>
    </message>
    <message>
        <source>A note on this entry; it cannot be changed later.</source>
        <translation>对该条目的备注；录入后不能更改。</translation>
    </message>
    <message>
        <source>Note</source>
        <translation>备注</translation>
    </message>
    <message>
        <source>Enter</source>
        <translation>录入</translation>
    </message>
    <message>
        <source>Entry {0} was changed since it was entered. Nothing that it says now can be trusted; restore the archive from a copy.</source>
        <translation>条目 {0} 在录入之后被更改。其现有内容不可信；请用副本恢复档案库。</translation>
    </message>
    <message>
        <source>Add a note...</source>
        <translation>添加备注...</translation>
    </message>
    <message>
        <source>Put in force again...</source>
        <translation>重新生效...</translation>
    </message>
    <message>
        <source>Choose an entry.</source>
        <translation>请选择一个条目。</translation>
    </message>
    <message>
        <source>Say something of this entry</source>
        <translation>对该条目作说明</translation>
    </message>
    <message>
        <source>As a new entry</source>
        <translation>作为新条目</translation>
    </message>
    <message>
        <source>Record on paper...</source>
        <translation>纸质记录...</translation>
    </message>
    <message>
        <source>Look at it, save it as PDF or print it</source>
        <translation>查看、存为 PDF 或打印</translation>
    </message>
    <message>
        <source>No entry is chosen.</source>
        <translation>未选择条目。</translation>
    </message>
    <message>
        <source>d MMMM yyyy, hh:mm</source>
        <translation>yyyy年M月d日 hh:mm</translation>
    </message>
    <message>
        <source>Entry {0}, {1}, SHA-256 {2}</source>
        <translation>条目 {0}，{1}，SHA-256 {2}</translation>
    </message>
    <message>
        <source>Station {0}</source>
        <translation>工位 {0}</translation>
    </message>
    <message>
        <source>by {0}</source>
        <translation>操作员 {0}</translation>
    </message>
    <message>
        <source>Pen {0}</source>
        <translation>光笔 {0}</translation>
    </message>
    <message>
        <source>Tip {0}</source>
        <translation>测头 {0}</translation>
    </message>
    <message>
        <source>Cone {0}</source>
        <translation>锥孔 {0}</translation>
    </message>
    <message>
        <source>Only a tip that was accepted can be put in force.</source>
        <translation>只有已接受的测头数据才能生效。</translation>
    </message>
    <message>
        <source>It is in force.</source>
        <translation>该数据正在生效。</translation>
    </message>
    <message>
        <source>Only a tip that was accepted has a record on paper.</source>
        <translation>只有已接受的测头才有纸质记录。</translation>
    </message>
    <message>
        <source>Its result is at the station that it is of.</source>
        <translation>其结果保存在所属工位。</translation>
    </message>
</context>
<context>
    <name>ExposureBar</name>
    <message>
        <source>Exposure of the LEDs</source>
        <translation>LED 曝光</translation>
    </message>
    <message>
        <source>No LED is seen</source>
        <translation>看不到 LED</translation>
    </message>
    <message>
        <source>Saturated: {0} of {1} LEDs</source>
        <translation>饱和：{1} 个 LED 中有 {0} 个</translation>
    </message>
    <message>
        <source>Saturated: {0} of {1} spots</source>
        <translation>饱和：{1} 个光点中有 {0} 个</translation>
    </message>
    <message>
        <source>Too dark: {0} of {1} LEDs</source>
        <translation>过暗：{1} 个 LED 中有 {0} 个</translation>
    </message>
    <message>
        <source>Too dark: {0} of {1} spots</source>
        <translation>过暗：{1} 个光点中有 {0} 个</translation>
    </message>
    <message>
        <source>Good: {0} LEDs</source>
        <translation>合适：{0} 个 LED</translation>
    </message>
    <message>
        <source>Good: {0} spots</source>
        <translation>合适：{0} 个光点</translation>
    </message>
    <message>
        <source>LED {0}: {1} %</source>
        <translation>LED {0}：{1} %</translation>
    </message>
    <message>
        <source>dark</source>
        <translation>过暗</translation>
    </message>
    <message>
        <source>good</source>
        <translation>合适</translation>
    </message>
    <message>
        <source>saturated</source>
        <translation>饱和</translation>
    </message>
</context>
<context>
    <name>ExposurePanel</name>
    <message>
        <source>E&amp;xposure</source>
        <translation>曝光(&amp;X)</translation>
    </message>
    <message>
        <source>Exposure</source>
        <translation>曝光</translation>
    </message>
    <message>
        <source>&amp;Gain</source>
        <translation>增益(&amp;G)</translation>
    </message>
    <message>
        <source>Gain</source>
        <translation>增益</translation>
    </message>
    <message>
        <source>Up and Down change it; Enter takes a typed number.</source>
        <translation>用上下键调整；输入数值后按 Enter。</translation>
    </message>
    <message>
        <source>Stop</source>
        <translation>停止</translation>
    </message>
    <message>
        <source>Set by the LEDs</source>
        <translation>按 LED 设定</translation>
    </message>
    <message>
        <source>Exposure and gain for 80 % of full scale at the brightest LED.</source>
        <translation>设定曝光和增益，使最亮的 LED 达到满量程的 80 %。</translation>
    </message>
    <message>
        <source>No images come.</source>
        <translation>没有图像。</translation>
    </message>
    <message>
        <source>Recorded: exposure and gain are as they were taken.</source>
        <translation>录制的图像：曝光和增益为拍摄时的值。</translation>
    </message>
    <message>
        <source>Hold the pen still. Brightest LED: {0}</source>
        <translation>请保持光笔不动。最亮的 LED：{0}</translation>
    </message>
    <message>
        <source>Set. Brightest LED: {0}, none is saturated.</source>
        <translation>已设定。最亮的 LED：{0}，没有 LED 饱和。</translation>
    </message>
    <message>
        <source>No LEDs are seen. Hold the pen before the camera.</source>
        <translation>看不到 LED。请把光笔放到相机前。</translation>
    </message>
    <message>
        <source>The least exposure and gain are too bright ({0}). Close the aperture of the lens.</source>
        <translation>曝光和增益已最小，仍然过亮（{0}）。请调小镜头光圈。</translation>
    </message>
    <message>
        <source>The LEDs reach {0} only: a longer exposure would smear the moving pen. Open the aperture of the lens.</source>
        <translation>LED 只能达到 {0}：再延长曝光会使移动的光笔拖影。请调大镜头光圈。</translation>
    </message>
    <message>
        <source>The light changes from image to image ({0}). Hold the pen still, and check the supply of its LEDs.</source>
        <translation>各幅图像的亮度不一致（{0}）。请保持光笔不动，并检查 LED 的供电。</translation>
    </message>
    <message>
        <source>Hold the pen so that the camera sees its LEDs.</source>
        <translation>握住光笔，使相机能看到 LED。</translation>
    </message>
    <message>
        <source>All lie in the good part of the scale.</source>
        <translation>全部位于“合适”区间。</translation>
    </message>
    <message>
        <source>Lower the gain until no LED is saturated.</source>
        <translation>降低增益，直到没有 LED 饱和。</translation>
    </message>
    <message>
        <source>Shorten the exposure until no LED is saturated.</source>
        <translation>缩短曝光，直到没有 LED 饱和。</translation>
    </message>
    <message>
        <source>Lengthen the exposure until all LEDs are good.</source>
        <translation>延长曝光，直到所有 LED 都合适。</translation>
    </message>
    <message>
        <source>Raise the gain: a longer exposure would smear the moving pen.</source>
        <translation>提高增益：再延长曝光会使移动的光笔拖影。</translation>
    </message>
    <message>
        <source>The LEDs differ too much in brightness. Clean them, and check their supply.</source>
        <translation>各 LED 亮度相差太大。请清洁 LED，并检查供电。</translation>
    </message>
    <message>
        <source>Take the images again with a shorter exposure.</source>
        <translation>请用更短的曝光重新拍摄。</translation>
    </message>
    <message>
        <source>Take the images again with a longer exposure.</source>
        <translation>请用更长的曝光重新拍摄。</translation>
    </message>
    <message>
        <source>Close the aperture of the lens a little.</source>
        <translation>把镜头光圈调小一点。</translation>
    </message>
    <message>
        <source>Open the aperture of the lens a little.</source>
        <translation>把镜头光圈调大一点。</translation>
    </message>
</context>
<context>
    <name>FilterBar</name>
    <message>
        <source>Pen</source>
        <translation>光笔</translation>
    </message>
    <message>
        <source>Tip</source>
        <translation>测头</translation>
    </message>
    <message>
        <source>Station</source>
        <translation>工位</translation>
    </message>
    <message>
        <source>From</source>
        <translation>从</translation>
    </message>
    <message>
        <source>To</source>
        <translation>至</translation>
    </message>
    <message>
        <source>What</source>
        <translation>类型</translation>
    </message>
    <message>
        <source>All</source>
        <translation>全部</translation>
    </message>
</context>
<context>
    <name>FixedPointFinding</name>
    <message>
        <source>Cone in the frame of the camera / mm</source>
        <translation>相机坐标系中的锥孔 / mm</translation>
    </message>
    <message>
        <source>Both tips / mm</source>
        <translation>两个测头 / mm</translation>
    </message>
    <message>
        <source>Average</source>
        <translation>平均值</translation>
    </message>
    <message>
        <source>U (k = 2) of it</source>
        <translation>其 U (k = 2)</translation>
    </message>
    <message>
        <source>Std expected</source>
        <translation>预期标准差</translation>
    </message>
    <message>
        <source>Tip wanted less own</source>
        <translation>所需测头减现有测头</translation>
    </message>
    <message>
        <source>its U (k = 2)</source>
        <translation>其 U (k = 2)</translation>
    </message>
    <message>
        <source>Nominal tip</source>
        <translation>标称测头</translation>
    </message>
    <message>
        <source>Std</source>
        <translation>标准差</translation>
    </message>
    <message>
        <source>Range</source>
        <translation>极差</translation>
    </message>
</context>
<context>
    <name>FixedPointStrip</name>
    <message>
        <source>Touch the cone again</source>
        <translation>再次触测锥孔</translation>
    </message>
    <message>
        <source>Touches</source>
        <translation>触测次数</translation>
    </message>
</context>
<context>
    <name>FocusMeter</name>
    <message>
        <source>No LED is seen</source>
        <translation>看不到 LED</translation>
    </message>
    <message>
        <source>Saturated</source>
        <translation>饱和</translation>
    </message>
    <message>
        <source>Sharp</source>
        <translation>清晰</translation>
    </message>
    <message>
        <source>Soft</source>
        <translation>模糊</translation>
    </message>
    <message>
        <source>{0} px</source>
        <translation>{0} px</translation>
    </message>
    <message>
        <source>limit {0}</source>
        <translation>限值 {0}</translation>
    </message>
    <message>
        <source>Width of the LEDs&apos; rims</source>
        <translation>LED 边缘宽度</translation>
    </message>
</context>
<context>
    <name>FocusPanel</name>
    <message>
        <source>Recorded: the focus is as it was.</source>
        <translation>录制的图像：对焦保持当时状态。</translation>
    </message>
    <message>
        <source>Lower the exposure first: now this tells nothing.</source>
        <translation>请先降低曝光：目前该值无意义。</translation>
    </message>
    <message>
        <source>Turn the focus ring until the rims are narrowest.</source>
        <translation>转动对焦环，使边缘最窄。</translation>
    </message>
    <message>
        <source>Width of the LEDs&apos; rims from dark to bright. Hold the pen still.</source>
        <translation>LED 边缘由暗到亮的宽度。请保持光笔不动。</translation>
    </message>
</context>
<context>
    <name>FramePanel</name>
    <message>
        <source>Pen and its frame</source>
        <translation>光笔及其坐标系</translation>
    </message>
    <message>
        <source>Put into the pen frame</source>
        <translation>转换到光笔坐标系</translation>
    </message>
    <message>
        <source>These are coordinates in another frame, such as a measuring machine&apos;s.</source>
        <translation>这些坐标属于其他坐标系，例如测量机坐标系。</translation>
    </message>
    <message>
        <source>Not the layout of the ten-LED pen: the frame of the file is taken as it is.</source>
        <translation>不是十 LED 光笔的布局：直接采用文件的坐标系。</translation>
    </message>
    <message>
        <source>fulfilled</source>
        <translation>满足</translation>
    </message>
    <message>
        <source>not fulfilled</source>
        <translation>不满足</translation>
    </message>
    <message>
        <source>LEDs well apart</source>
        <translation>LED 间距足够</translation>
    </message>
    <message>
        <source>Numbers in order</source>
        <translation>编号顺序正确</translation>
    </message>
    <message>
        <source>LEDs 1 to 4 in a line</source>
        <translation>LED 1 至 4 共线</translation>
    </message>
    <message>
        <source>LED 1 over the origin</source>
        <translation>LED 1 位于原点上方</translation>
    </message>
    <message>
        <source>y along LEDs 1 to 4</source>
        <translation>y 轴沿 LED 1 至 4</translation>
    </message>
    <message>
        <source>LEDs 5 to 10 at z = 0</source>
        <translation>LED 5 至 10 位于 z = 0</translation>
    </message>
    <message>
        <source>Axes right-handed</source>
        <translation>右手坐标系</translation>
    </message>
    <message>
        <source>Discs face the viewer</source>
        <translation>发光面朝向观察者</translation>
    </message>
</context>
<context>
    <name>HandPanel</name>
    <message>
        <source>Simulated pen</source>
        <translation>模拟光笔</translation>
    </message>
    <message>
        <source>Let the simulated operator swing</source>
        <translation>让模拟操作员摆动</translation>
    </message>
    <message>
        <source>It seats the tip and follows the arrow by itself.</source>
        <translation>自动将测头就位并跟随箭头。</translation>
    </message>
    <message>
        <source>Seat</source>
        <translation>就位</translation>
    </message>
    <message>
        <source>Put the tip into the cone; then drag the dot of the dial.</source>
        <translation>把测头放入锥孔；然后拖动姿态盘上的圆点。</translation>
    </message>
    <message>
        <source>Swing</source>
        <translation>摆动</translation>
    </message>
    <message>
        <source>Swing the pen round the cone, whatever the arrow says.</source>
        <translation>绕锥孔摆动光笔，不理会箭头。</translation>
    </message>
    <message>
        <source>Hold</source>
        <translation>保持</translation>
    </message>
    <message>
        <source>Hold the pen still as it is.</source>
        <translation>保持光笔现在的姿态不动。</translation>
    </message>
    <message>
        <source>Lift</source>
        <translation>抬起</translation>
    </message>
    <message>
        <source>Take the tip out of the cone.</source>
        <translation>把测头从锥孔中抬起。</translation>
    </message>
    <message>
        <source>Leave</source>
        <translation>离开</translation>
    </message>
    <message>
        <source>Take the pen out of the image.</source>
        <translation>把光笔移出图像。</translation>
    </message>
    <message>
        <source>Slip</source>
        <translation>滑动</translation>
    </message>
    <message>
        <source>Let the tip slip by {0} mm for a moment.</source>
        <translation>让测头短暂滑动 {0} mm。</translation>
    </message>
    <message>
        <source>Cover</source>
        <translation>遮挡</translation>
    </message>
    <message>
        <source>Hold a hand before the LEDs for a moment.</source>
        <translation>用手短暂挡住 LED。</translation>
    </message>
</context>
<context>
    <name>HandRow</name>
    <message>
        <source>Lean the pen</source>
        <translation>倾斜光笔</translation>
    </message>
    <message>
        <source>The simulated pen is leaned to all sides until you end it.</source>
        <translation>模拟光笔向各个方向倾斜，直到您结束为止。</translation>
    </message>
    <message>
        <source>Cover LEDs</source>
        <translation>遮挡 LED</translation>
    </message>
    <message>
        <source>Hold a hand before three LEDs of the simulated pen.</source>
        <translation>用手遮住模拟光笔的三个 LED。</translation>
    </message>
</context>
<context>
    <name>HelpWindow</name>
    <message>
        <source>Help</source>
        <translation>帮助</translation>
    </message>
</context>
<context>
    <name>HistoryContent</name>
    <message>
        <source>Trend</source>
        <translation>趋势</translation>
    </message>
    <message>
        <source>Entry</source>
        <translation>条目</translation>
    </message>
    <message>
        <source>Repeatability</source>
        <translation>重复性</translation>
    </message>
    <message>
        <source>Due</source>
        <translation>到期</translation>
    </message>
    <message>
        <source>Archive</source>
        <translation>档案库</translation>
    </message>
    <message>
        <source>{0} entries</source>
        <translation>{0} 个条目</translation>
    </message>
    <message>
        <source>Tip {0} of pen {1} is in force as it was calibrated then.</source>
        <translation>光笔 {1} 的测头 {0} 已按当时的标定重新生效。</translation>
    </message>
    <message>
        <source>Saved in {0}</source>
        <translation>已保存到 {0}</translation>
    </message>
    <message>
        <source>Entries of another station</source>
        <translation>另一工位的条目</translation>
    </message>
    <message>
        <source>{0} entries are new, {1} were there already.</source>
        <translation>新增 {0} 个条目，已有 {1} 个。</translation>
    </message>
    <message>
        <source>Save entries</source>
        <translation>保存条目</translation>
    </message>
    <message>
        <source>{0} entries are saved in {1}</source>
        <translation>{0} 个条目已保存到 {1}</translation>
    </message>
</context>
<context>
    <name>HistoryModel</name>
    <message>
        <source>When</source>
        <translation>时间</translation>
    </message>
    <message>
        <source>Station</source>
        <translation>工位</translation>
    </message>
    <message>
        <source>Pen</source>
        <translation>光笔</translation>
    </message>
    <message>
        <source>Tip</source>
        <translation>测头</translation>
    </message>
    <message>
        <source>What</source>
        <translation>内容</translation>
    </message>
    <message>
        <source>Verdict</source>
        <translation>结论</translation>
    </message>
    <message>
        <source>x / mm</source>
        <translation>x / mm</translation>
    </message>
    <message>
        <source>y / mm</source>
        <translation>y / mm</translation>
    </message>
    <message>
        <source>z / mm</source>
        <translation>z / mm</translation>
    </message>
    <message>
        <source>U / mm</source>
        <translation>U / mm</translation>
    </message>
    <message>
        <source>By</source>
        <translation>操作员</translation>
    </message>
    <message>
        <source>Words</source>
        <translation>说明</translation>
    </message>
</context>
<context>
    <name>HistoryPage</name>
    <message>
        <source>History</source>
        <translation>历史</translation>
    </message>
    <message>
        <source>All that ever became of a tip. Nothing here is ever changed.</source>
        <translation>测头的全部经历。此处的内容从不更改。</translation>
    </message>
    <message>
        <source>Next calibration</source>
        <translation>下一次标定</translation>
    </message>
</context>
<context>
    <name>HistoryTable</name>
    <message>
        <source>Entries of the archive, the newest first</source>
        <translation>档案库条目，最新的在前</translation>
    </message>
</context>
<context>
    <name>ImageModel</name>
    <message>
        <source>Image</source>
        <translation>图像</translation>
    </message>
    <message>
        <source>Misfit / px</source>
        <translation>误差 / px</translation>
    </message>
    <message>
        <source>LEDs</source>
        <translation>LED</translation>
    </message>
    <message>
        <source>State</source>
        <translation>状态</translation>
    </message>
    <message>
        <source>used</source>
        <translation>已使用</translation>
    </message>
</context>
<context>
    <name>ImageTable</name>
    <message>
        <source>Images, the worst first</source>
        <translation>图像，最差的在前</translation>
    </message>
</context>
<context>
    <name>ImageView</name>
    <message>
        <source>Live image</source>
        <translation>实时图像</translation>
    </message>
</context>
<context>
    <name>ImagesPanel</name>
    <message>
        <source>Take out</source>
        <translation>剔除</translation>
    </message>
    <message>
        <source>Put back</source>
        <translation>恢复</translation>
    </message>
    <message>
        <source>Misfit / px (x: left out)</source>
        <translation>拟合误差 / px（x：已舍去）</translation>
    </message>
    <message>
        <source>image</source>
        <translation>图像</translation>
    </message>
    <message>
        <source>drag down to take out</source>
        <translation>向下拖动以剔除</translation>
    </message>
    <message>
        <source>take out {0} above {1} px</source>
        <translation>剔除高于 {1} px 的 {0} 幅</translation>
    </message>
    <message>
        <source>{0} of {1} used</source>
        <translation>使用 {0} / {1} 幅</translation>
    </message>
    <message>
        <source>{0} {1}</source>
        <translation>{1} {0} 幅</translation>
    </message>
    <message>
        <source>; </source>
        <translation>；</translation>
    </message>
    <message>
        <source>No image is selected.</source>
        <translation>未选择图像。</translation>
    </message>
    <message>
        <source>It does not take part already.</source>
        <translation>该图像本来就不参与计算。</translation>
    </message>
    <message>
        <source>Leave the selected images out and solve again (Delete)</source>
        <translation>剔除所选图像并重新求解（Delete）</translation>
    </message>
    <message>
        <source>Let the selected images take part again (Insert)</source>
        <translation>恢复所选图像并重新求解（Insert）</translation>
    </message>
    <message>
        <source>It takes part already.</source>
        <translation>该图像已参与计算。</translation>
    </message>
    <message>
        <source>It would be left out again: {0}.</source>
        <translation>仍会被舍去：{0}。</translation>
    </message>
    <message>
        <source>Image {0}; arrows: residuals × {1}</source>
        <translation>图像 {0}；箭头：残差 × {1}</translation>
    </message>
    <message>
        <source>Image {0}: the pen is not found. {1}</source>
        <translation>图像 {0}：未找到光笔。{1}</translation>
    </message>
    <message>
        <source>The image cannot be shown.</source>
        <translation>无法显示该图像。</translation>
    </message>
</context>
<context>
    <name>ImagesRow</name>
    <message>
        <source>Choose...</source>
        <translation>选择...</translation>
    </message>
    <message>
        <source>Folder, video or record of images</source>
        <translation>图像的文件夹、视频或记录</translation>
    </message>
    <message>
        <source>Held still</source>
        <translation>握住不动</translation>
    </message>
    <message>
        <source>A touch is several images through which the pen is held still; else each image is a touch.</source>
        <translation>一次触测是光笔握住不动的几幅图像；否则每幅图像就是一次触测。</translation>
    </message>
    <message>
        <source>Read</source>
        <translation>读取</translation>
    </message>
    <message>
        <source>Do this task with recorded images: a folder, or one of folders.</source>
        <translation>用录制的图像完成该项：一个文件夹，或由多个文件夹组成的文件夹。</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>取消</translation>
    </message>
    <message>
        <source>Progress of reading</source>
        <translation>读取进度</translation>
    </message>
    <message>
        <source>Folder of recorded images</source>
        <translation>录制图像的文件夹</translation>
    </message>
</context>
<context>
    <name>InterruptedControl</name>
    <message>
        <source>The swing is being read.</source>
        <translation>正在读取摆动。</translation>
    </message>
    <message>
        <source>No camera is open. Choose the source of the images of this swing at the step Camera: {0}. Then resume the swing here.</source>
        <translation>没有打开相机。请在“相机”步骤选择该摆动的图像来源：{0}，再回到这里继续摆动。</translation>
    </message>
    <message>
        <source>The swing was captured with another source of images: {0}. Choose that source at the step Camera, then resume the swing here.</source>
        <translation>该摆动由另一图像来源采集：{0}。请在“相机”步骤选择该来源，再回到这里继续摆动。</translation>
    </message>
    <message>
        <source>The camera sends {0} x {1}, the swing was captured with {2} x {3}. Choose its camera at the step Camera, then resume the swing here.</source>
        <translation>相机图像为 {0} × {1}，该摆动采集时为 {2} × {3}。请在“相机”步骤选择当时的相机，再回到这里继续摆动。</translation>
    </message>
    <message>
        <source>The swing is being discarded.</source>
        <translation>正在放弃摆动。</translation>
    </message>
    <message>
        <source>Discarded. The images stay in {0}.</source>
        <translation>已放弃。图像保留在 {0}。</translation>
    </message>
    <message>
        <source>The verification is being read.</source>
        <translation>正在读取验证。</translation>
    </message>
    <message>
        <source>The verification is being closed.</source>
        <translation>正在结束验证。</translation>
    </message>
    <message>
        <source>Closed as abandoned; see History.</source>
        <translation>已作为放弃结束，见“历史”。</translation>
    </message>
</context>
<context>
    <name>InterruptedPanel</name>
    <message>
        <source>Interrupted: {0}</source>
        <translation>中断的项目：{0}</translation>
    </message>
    <message>
        <source>Interrupted verification</source>
        <translation>中断的验证</translation>
    </message>
    <message>
        <source>Interrupted swings: {0}</source>
        <translation>中断的摆动：{0}</translation>
    </message>
    <message>
        <source>Interrupted swing</source>
        <translation>中断的摆动</translation>
    </message>
    <message>
        <source>Resumed, it has all its images and the files it began with.</source>
        <translation>继续时保留全部图像，并使用开始时的文件。</translation>
    </message>
    <message>
        <source>Look again</source>
        <translation>重新查找</translation>
    </message>
</context>
<context>
    <name>InterruptedRow</name>
    <message>
        <source>d MMM yyyy, hh:mm</source>
        <translation>yyyy年M月d日 hh:mm</translation>
    </message>
    <message>
        <source>Discard it? Its images stay on the disk.</source>
        <translation>放弃吗？图像留在磁盘上。</translation>
    </message>
    <message>
        <source>Resume</source>
        <translation>继续</translation>
    </message>
    <message>
        <source>Resume the swing of {0}</source>
        <translation>继续 {0} 的摆动</translation>
    </message>
    <message>
        <source>Discard</source>
        <translation>放弃</translation>
    </message>
    <message>
        <source>Discard the swing of {0}</source>
        <translation>放弃 {0} 的摆动</translation>
    </message>
    <message>
        <source>Keep</source>
        <translation>保留</translation>
    </message>
    <message>
        <source>Keep the swing of {0}</source>
        <translation>保留 {0} 的摆动</translation>
    </message>
    <message>
        <source>Damaged: {0}</source>
        <translation>已损坏：{0}</translation>
    </message>
    <message>
        <source>Another program is capturing it.</source>
        <translation>另一个程序正在采集。</translation>
    </message>
</context>
<context>
    <name>IntrinsicsPanel</name>
    <message>
        <source>Intrinsics of camera and lens</source>
        <translation>相机与镜头的内参</translation>
    </message>
    <message>
        <source>Intrinsics of OpenCV, ROS, Kalibr, MATLAB ({0})</source>
        <translation>OpenCV、ROS、Kalibr、MATLAB 内参 ({0})</translation>
    </message>
    <message>
        <source>Intrinsics file</source>
        <translation>内参文件</translation>
    </message>
    <message>
        <source>Open...</source>
        <translation>打开...</translation>
    </message>
    <message>
        <source>Calibrate this camera...</source>
        <translation>标定此相机...</translation>
    </message>
    <message>
        <source>In use</source>
        <translation>使用中</translation>
    </message>
    <message>
        <source>Focal lengths</source>
        <translation>焦距</translation>
    </message>
    <message>
        <source>Principal point</source>
        <translation>主点</translation>
    </message>
    <message>
        <source>Distortion</source>
        <translation>畸变</translation>
    </message>
    <message>
        <source>Calibrated</source>
        <translation>标定日期</translation>
    </message>
    <message>
        <source>Open the file with the calibration of camera and lens.</source>
        <translation>打开相机与镜头的标定文件。</translation>
    </message>
    <message>
        <source>Made for images of {0}</source>
        <translation>适用的图像尺寸：{0}</translation>
    </message>
    <message>
        <source>Fits the live images: {0}</source>
        <translation>与实时图像一致：{0}</translation>
    </message>
    <message>
        <source>The camera sends {0}, the calibration file was made for {1}. Choose the file for this camera, set the region to the whole sensor, or switch off binning.</source>
        <translation>相机送来 {0}，标定文件是为 {1} 做的。请选择此相机的文件，把区域设为整个传感器，或关闭像素合并。</translation>
    </message>
    <message>
        <source>Checked by the swing: file and camera agree.</source>
        <translation>已由摆动检查：文件与相机一致。</translation>
    </message>
    <message>
        <source>no date</source>
        <translation>无日期</translation>
    </message>
    <message>
        <source>, no uncertainty in the file</source>
        <translation>，文件未给出不确定度</translation>
    </message>
    <message>
        <source>{0} and {1} px</source>
        <translation>{0} 和 {1} px</translation>
    </message>
    <message>
        <source>{0} x {1}</source>
        <translation>{0} × {1}</translation>
    </message>
</context>
<context>
    <name>Introduction</name>
    <message>
        <source>What is this?</source>
        <translation>这是什么？</translation>
    </message>
    <message>
        <source>Where is the tip of the pen?</source>
        <translation>光笔的测头在哪里？</translation>
    </message>
    <message>
        <source>The pen carries LEDs that a camera sees. What it touches with its tip can be measured, once it is known where the tip is from the LEDs. That is what is calibrated.</source>
        <translation>光笔上装有相机可见的 LED。只有知道测头相对于 LED 的位置，才能测量测头所接触的点。标定的就是这个位置。</translation>
    </message>
    <message>
        <source>The tip rests in a cone and stays there while the pen is leaned to all sides. The only point of the pen that does not move is the centre of its tip.</source>
        <translation>测头放在锥孔中保持不动，光笔向各个方向倾斜。光笔上唯一不动的点就是测头的中心。</translation>
    </message>
    <message>
        <source>Start</source>
        <translation>开始</translation>
    </message>
    <message>
        <source>say which pen and which tip.</source>
        <translation>填写光笔和测头。</translation>
    </message>
    <message>
        <source>Camera</source>
        <translation>相机</translation>
    </message>
    <message>
        <source>see that the images are bright and sharp.</source>
        <translation>确认图像明亮、清晰。</translation>
    </message>
    <message>
        <source>LEDs</source>
        <translation>LED</translation>
    </message>
    <message>
        <source>see that the file of the LEDs is that of this pen.</source>
        <translation>确认 LED 文件属于这支光笔。</translation>
    </message>
    <message>
        <source>Swing</source>
        <translation>摆动</translation>
    </message>
    <message>
        <source>lean the pen as the arrow shows; no key is needed.</source>
        <translation>按箭头倾斜光笔，无需按键。</translation>
    </message>
    <message>
        <source>Review</source>
        <translation>复核</translation>
    </message>
    <message>
        <source>see how certain the tip is, and accept it.</source>
        <translation>查看测头的不确定度，然后接受。</translation>
    </message>
    <message>
        <source>Close</source>
        <translation>关闭</translation>
    </message>
    <message>
        <source>Try it with a simulated pen</source>
        <translation>用模拟光笔试一试</translation>
    </message>
</context>
<context>
    <name>ItemButton</name>
    <message>
        <source>Tip library...</source>
        <translation>测头库...</translation>
    </message>
    <message>
        <source>List</source>
        <translation>列表</translation>
    </message>
</context>
<context>
    <name>ItemForm</name>
    <message>
        <source>End the spin</source>
        <translation>结束旋转</translation>
    </message>
    <message>
        <source>By a spin</source>
        <translation>旋转求轴线</translation>
    </message>
    <message>
        <source>Picture of the tip</source>
        <translation>测头图片</translation>
    </message>
    <message>
        <source>Pictures (*.png *.jpg *.jpeg *.bmp)</source>
        <translation>图片 (*.png *.jpg *.jpeg *.bmp)</translation>
    </message>
    <message>
        <source>not known</source>
        <translation>未知</translation>
    </message>
    <message>
        <source>as the station</source>
        <translation>按工位规定</translation>
    </message>
    <message>
        <source>Id, as on its label</source>
        <translation>编号，与标签一致</translation>
    </message>
    <message>
        <source>To be used until</source>
        <translation>可用至</translation>
    </message>
    <message>
        <source>Ball diameter</source>
        <translation>测球直径</translation>
    </message>
    <message>
        <source>Change at most</source>
        <translation>最大变化</translation>
    </message>
    <message>
        <source>Days in force at most</source>
        <translation>最长有效天数</translation>
    </message>
    <message>
        <source>Swings of its pen at most</source>
        <translation>该光笔最多摆动次数</translation>
    </message>
    <message>
        <source>Nominal centre of the tip</source>
        <translation>测头标称中心</translation>
    </message>
    <message>
        <source>Picture</source>
        <translation>图片</translation>
    </message>
    <message>
        <source>Note</source>
        <translation>备注</translation>
    </message>
    <message>
        <source>The last day, such as {0}; empty for no end.</source>
        <translation>最后可用日，例如 {0}；留空表示无期限。</translation>
    </message>
    <message>
        <source>no limit</source>
        <translation>无限值</translation>
    </message>
    <message>
        <source>How far a calibration may find the tip from where it was. Beyond it, the tip is to be checked.</source>
        <translation>标定时测头与原位置的最大允许距离。超出时，测头需检查。</translation>
    </message>
    <message>
        <source>Axis of the stylus, from the ball into the pen</source>
        <translation>测杆轴线，由测球指向光笔</translation>
    </message>
    <message>
        <source>Axis of the stylus, {0}</source>
        <translation>测杆轴线，{0}</translation>
    </message>
    <message>
        <source>Find the axis: the tip rests in the cone, and the pen is turned about its stylus before the camera.</source>
        <translation>求轴线：测头放在锥孔中，在相机前绕测杆转动光笔。</translation>
    </message>
    <message>
        <source>Browse...</source>
        <translation>浏览...</translation>
    </message>
</context>
<context>
    <name>LastResultPanel</name>
    <message>
        <source>Prove the tip in minutes by touching what is known.</source>
        <translation>触测已知的标准件，几分钟内即可验证测头。</translation>
    </message>
    <message>
        <source>Last practice with this pen and tip</source>
        <translation>本光笔和测头的上次练习</translation>
    </message>
    <message>
        <source>Last calibration of this pen and tip</source>
        <translation>本光笔和测头的上次标定</translation>
    </message>
    <message>
        <source>Verify it</source>
        <translation>验证</translation>
    </message>
    <message>
        <source>Take back...</source>
        <translation>撤回...</translation>
    </message>
    <message>
        <source>Put the result before in force again; both are kept.</source>
        <translation>使之前的结果重新生效；两者都保留。</translation>
    </message>
    <message>
        <source>Take this acceptance back? The result before is in force again.</source>
        <translation>撤回此次接受吗？之前的结果将重新生效。</translation>
    </message>
    <message>
        <source>Take back</source>
        <translation>撤回</translation>
    </message>
    <message>
        <source>Leave it in force</source>
        <translation>保持生效</translation>
    </message>
    <message>
        <source>None yet</source>
        <translation>尚无结果</translation>
    </message>
    <message>
        <source>What you accept is kept apart from the tips of real pens.</source>
        <translation>在此接受的结果与真实光笔的测头分开保存。</translation>
    </message>
    <message>
        <source>The tip that you accept will be the first in force.</source>
        <translation>您接受的测头将首次生效。</translation>
    </message>
    <message>
        <source>It is shown when the pen and its tip are named.</source>
        <translation>填写光笔和测头后显示。</translation>
    </message>
    <message>
        <source>d MMMM yyyy, hh:mm</source>
        <translation>yyyy年M月d日 hh:mm</translation>
    </message>
    <message>
        <source>Tip centre / mm</source>
        <translation>测头中心 / mm</translation>
    </message>
    <message>
        <source>U (k = 2) / mm</source>
        <translation>U (k = 2) / mm</translation>
    </message>
    <message>
        <source>Accepted with the reason: {0}</source>
        <translation>接受理由：{0}</translation>
    </message>
    <message>
        <source>Accepted by the supervisor {0} with the reason: {1}</source>
        <translation>由主管 {0} 接受，理由：{1}</translation>
    </message>
    <message>
        <source>It is dated later than now. Check the clock here.</source>
        <translation>日期晚于现在。请检查本机时钟。</translation>
    </message>
    <message>
        <source>It is older than {0} days. Calibrate before you measure.</source>
        <translation>已超过 {0} 天。测量前请先标定。</translation>
    </message>
    <message>
        <source>In the future</source>
        <translation>日期在将来</translation>
    </message>
    <message>
        <source>Today</source>
        <translation>今天</translation>
    </message>
    <message>
        <source>Yesterday</source>
        <translation>昨天</translation>
    </message>
    <message>
        <source>{0} days ago</source>
        <translation>{0} 天前</translation>
    </message>
    <message>
        <source>{0} months ago</source>
        <translation>{0} 个月前</translation>
    </message>
    <message>
        <source>{0} years ago</source>
        <translation>{0} 年前</translation>
    </message>
</context>
<context>
    <name>LeaningDial</name>
    <message>
        <source>Drag to lean the simulated pen, or use the arrow keys. The wheel, or the keys , and . turn it about its own axis.</source>
        <translation>拖动或用方向键倾斜模拟光笔。滚轮或 , 和 . 键使其绕自身轴线转动。</translation>
    </message>
</context>
<context>
    <name>LedFilePanel</name>
    <message>
        <source>Exchange {0} and {1}</source>
        <translation>交换 {0} 和 {1}</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>取消</translation>
    </message>
    <message>
        <source>LEDs of the pen</source>
        <translation>光笔的 LED</translation>
    </message>
    <message>
        <source>LEDs of a pen ({0})</source>
        <translation>光笔 LED 文件 ({0})</translation>
    </message>
    <message>
        <source>Save the LEDs</source>
        <translation>保存 LED</translation>
    </message>
    <message>
        <source>Tables ({0})</source>
        <translation>表格 ({0})</translation>
    </message>
    <message>
        <source>With name and nominal tip ({0})</source>
        <translation>含名称和标称测头 ({0})</translation>
    </message>
    <message>
        <source>{0} exists already. Replace it by these LEDs?</source>
        <translation>{0} 已存在。用这些 LED 替换它吗？</translation>
    </message>
    <message>
        <source>Replace</source>
        <translation>替换</translation>
    </message>
    <message>
        <source>LED &amp;file</source>
        <translation>LED 文件(&amp;F)</translation>
    </message>
    <message>
        <source>LED file</source>
        <translation>LED 文件</translation>
    </message>
    <message>
        <source>Table (CSV) or JSON file</source>
        <translation>表格 (CSV) 或 JSON 文件</translation>
    </message>
    <message>
        <source>Open...</source>
        <translation>打开...</translation>
    </message>
    <message>
        <source>Save as...</source>
        <translation>另存为...</translation>
    </message>
    <message>
        <source>Use the simulated pen&apos;s file</source>
        <translation>使用模拟光笔的文件</translation>
    </message>
    <message>
        <source>Save the LEDs and use that file.</source>
        <translation>保存 LED 并使用该文件。</translation>
    </message>
</context>
<context>
    <name>LedTable</name>
    <message>
        <source>LEDs of the pen, in mm</source>
        <translation>光笔的 LED，单位 mm</translation>
    </message>
</context>
<context>
    <name>LedTablePanel</name>
    <message>
        <source>Places of the LEDs in mm, changed</source>
        <translation>LED 位置 / mm（已修改）</translation>
    </message>
    <message>
        <source>Places of the LEDs in mm</source>
        <translation>LED 位置 / mm</translation>
    </message>
    <message>
        <source>Add an LED after the last.</source>
        <translation>在末尾添加一个 LED。</translation>
    </message>
    <message>
        <source>Choose an LED in the table first.</source>
        <translation>请先在表格中选择一个 LED。</translation>
    </message>
    <message>
        <source>A pen needs at least {0} LEDs.</source>
        <translation>光笔至少需要 {0} 个 LED。</translation>
    </message>
    <message>
        <source>Remove LED {0}; later ones get lower numbers.</source>
        <translation>删除 LED {0}；后面的编号依次前移。</translation>
    </message>
    <message>
        <source>Nothing is changed.</source>
        <translation>没有修改。</translation>
    </message>
    <message>
        <source>Go back to what the file has.</source>
        <translation>恢复为文件中的内容。</translation>
    </message>
    <message>
        <source>Go back to the file in use.</source>
        <translation>恢复为使用中的文件。</translation>
    </message>
    <message>
        <source>In force is the nominal tip of the step Start: {0} mm.</source>
        <translation>有效的是“开始”步骤中的标称测头：{0} mm。</translation>
    </message>
    <message>
        <source>Add</source>
        <translation>添加</translation>
    </message>
    <message>
        <source>Remove</source>
        <translation>删除</translation>
    </message>
    <message>
        <source>Discard</source>
        <translation>放弃</translation>
    </message>
    <message>
        <source>Show normals</source>
        <translation>显示法线</translation>
    </message>
    <message>
        <source>&amp;Disc Ø, mm</source>
        <translation>发光面 Ø, mm(&amp;D)</translation>
    </message>
    <message>
        <source>Diameter of the LED discs, mm</source>
        <translation>LED 发光面直径，mm</translation>
    </message>
    <message>
        <source>&amp;Tip x y z, mm</source>
        <translation>测头 x y z, mm(&amp;T)</translation>
    </message>
    <message>
        <source>Nominal centre of the tip, {0}, mm</source>
        <translation>测头标称中心 {0}，mm</translation>
    </message>
</context>
<context>
    <name>LedsPage</name>
    <message>
        <source>LEDs</source>
        <translation>LED</translation>
    </message>
    <message>
        <source>Open the file of this pen&apos;s LEDs; it is compared with what the recorded images show.</source>
        <translation>打开本光笔的 LED 文件；程序将其与录制的图像进行比较。</translation>
    </message>
    <message>
        <source>Open the file of this pen&apos;s LEDs and hold the pen before the camera.</source>
        <translation>打开本光笔的 LED 文件，并把光笔举在相机前。</translation>
    </message>
    <message>
        <source>Continue to the swing</source>
        <translation>下一步：摆动</translation>
    </message>
    <message>
        <source>The LED table has changes that are not saved.</source>
        <translation>LED 表格有未保存的修改。</translation>
    </message>
    <message>
        <source>Mend the LED table first: what is wrong is told above.</source>
        <translation>请先改正 LED 表格：错误见上方说明。</translation>
    </message>
    <message>
        <source>Save the LED table first: the record needs its file.</source>
        <translation>请先保存 LED 表格：记录需要该文件。</translation>
    </message>
    <message>
        <source>There are no LEDs yet.</source>
        <translation>还没有 LED。</translation>
    </message>
    <message>
        <source>Mend the LEDs first: a file of these cannot be used.</source>
        <translation>请先改正 LED：这样的文件无法使用。</translation>
    </message>
    <message>
        <source>Discard them</source>
        <translation>放弃修改</translation>
    </message>
    <message>
        <source>{0} stays open.</source>
        <translation>{0} 仍处于打开状态。</translation>
    </message>
    <message>
        <source>The LEDs are saved as {0} and in use.</source>
        <translation>LED 已保存为 {0} 并使用。</translation>
    </message>
    <message>
        <source>The camera is not open. See the step Camera.</source>
        <translation>相机未打开。请看“相机”步骤。</translation>
    </message>
    <message>
        <source>The camera is lost. It is looked for until it is back.</source>
        <translation>相机连接中断。程序会持续查找，直到恢复。</translation>
    </message>
    <message>
        <source>The intrinsics are missing. See the step Camera.</source>
        <translation>缺少内参。请看“相机”步骤。</translation>
    </message>
    <message>
        <source>Enter or mend the LEDs, so that they can be looked for.</source>
        <translation>请先输入或改正 LED，才能进行查找。</translation>
    </message>
</context>
<context>
    <name>LengthFinding</name>
    <message>
        <source>Length at each place / mm</source>
        <translation>各位置的长度 / mm</translation>
    </message>
    <message>
        <source>Length / mm</source>
        <translation>长度 / mm</translation>
    </message>
    <message>
        <source>Error / mm</source>
        <translation>误差 / mm</translation>
    </message>
    <message>
        <source>U (k = 2) / mm</source>
        <translation>U (k = 2) / mm</translation>
    </message>
    <message>
        <source>Limit / mm</source>
        <translation>限值 / mm</translation>
    </message>
    <message>
        <source>Scale of the pen by it: {0}, U (k = 2) {1} ppm; without it {2} ppm.</source>
        <translation>由此得到的光笔尺度：{0}，U (k = 2) {1} ppm；不用它时为 {2} ppm。</translation>
    </message>
    <message>
        <source>One end</source>
        <translation>一端</translation>
    </message>
    <message>
        <source>The other end</source>
        <translation>另一端</translation>
    </message>
</context>
<context>
    <name>LengthStrip</name>
    <message>
        <source>in cones</source>
        <translation>在锥孔内</translation>
    </message>
    <message>
        <source>inner faces</source>
        <translation>内侧面</translation>
    </message>
    <message>
        <source>outer faces</source>
        <translation>外侧面</translation>
    </message>
    <message>
        <source>not known</source>
        <translation>未知</translation>
    </message>
    <message>
        <source>Touch both ends</source>
        <translation>触测长度两端</translation>
    </message>
    <message>
        <source>Certified length</source>
        <translation>证书长度</translation>
    </message>
    <message>
        <source>Its U (k = 2)</source>
        <translation>其 U (k = 2)</translation>
    </message>
    <message>
        <source>Touched</source>
        <translation>触测部位</translation>
    </message>
    <message>
        <source>Places</source>
        <translation>位置数</translation>
    </message>
</context>
<context>
    <name>LibraryControl</name>
    <message>
        <source>There is no tip {0} in the library. Add it?</source>
        <translation>测头库中没有测头 {0}。是否添加？</translation>
    </message>
    <message>
        <source>Add it</source>
        <translation>添加</translation>
    </message>
    <message>
        <source>Not now</source>
        <translation>暂不</translation>
    </message>
    <message>
        <source>Tip {0} is retired: {1}</source>
        <translation>测头 {0} 已停用：{1}</translation>
    </message>
    <message>
        <source>choose another one.</source>
        <translation>请另选一个。</translation>
    </message>
    <message>
        <source>Tip {0}, by its barcode.</source>
        <translation>已按条码选择测头 {0}。</translation>
    </message>
</context>
<context>
    <name>LibraryDialog</name>
    <message>
        <source>A new one</source>
        <translation>新增</translation>
    </message>
    <message>
        <source>Bring {0} back</source>
        <translation>恢复使用 {0}</translation>
    </message>
    <message>
        <source>Retire {0}</source>
        <translation>停用 {0}</translation>
    </message>
    <message>
        <source>Choose one in the table.</source>
        <translation>请在表中选择一项。</translation>
    </message>
    <message>
        <source>It is retired.</source>
        <translation>已停用。</translation>
    </message>
    <message>
        <source>Calibrate with it</source>
        <translation>用它标定</translation>
    </message>
    <message>
        <source>Change what is said of it</source>
        <translation>更改其内容</translation>
    </message>
    <message>
        <source>It stays known either way</source>
        <translation>无论如何都会保留其记录</translation>
    </message>
    <message>
        <source>Bring back...</source>
        <translation>恢复使用...</translation>
    </message>
    <message>
        <source>Retire...</source>
        <translation>停用...</translation>
    </message>
    <message>
        <source>Enter an id.</source>
        <translation>请输入编号。</translation>
    </message>
    <message>
        <source>Enter a day such as 2026-08-14, or none.</source>
        <translation>请输入日期，例如 2026-08-14，或留空。</translation>
    </message>
    <message>
        <source>A supervisor signs each change.</source>
        <translation>每次更改须由主管签署。</translation>
    </message>
    <message>
        <source>It is being kept.</source>
        <translation>正在保存。</translation>
    </message>
    <message>
        <source>With your name and the time</source>
        <translation>连同您的姓名和时间一起保存</translation>
    </message>
    <message>
        <source>Tip library</source>
        <translation>测头库</translation>
    </message>
    <message>
        <source>Pens, tips and cones with their limits. Each change is kept with name and time, and entered in the archive.</source>
        <translation>光笔、测头和锥孔及其限值。每次更改都连同姓名和时间保存，并录入档案库。</translation>
    </message>
    <message>
        <source>Tips</source>
        <translation>测头</translation>
    </message>
    <message>
        <source>Pens</source>
        <translation>光笔</translation>
    </message>
    <message>
        <source>Cones</source>
        <translation>锥孔</translation>
    </message>
    <message>
        <source>Id</source>
        <translation>编号</translation>
    </message>
    <message>
        <source>State</source>
        <translation>状态</translation>
    </message>
    <message>
        <source>Until</source>
        <translation>可用至</translation>
    </message>
    <message>
        <source>Ball / mm</source>
        <translation>测球 / mm</translation>
    </message>
    <message>
        <source>Change / mm</source>
        <translation>变化 / mm</translation>
    </message>
    <message>
        <source>Calibrated on pens</source>
        <translation>已在以下光笔上标定</translation>
    </message>
    <message>
        <source>Note</source>
        <translation>备注</translation>
    </message>
    <message>
        <source>Show retired ones</source>
        <translation>显示已停用的</translation>
    </message>
    <message>
        <source>Choose</source>
        <translation>选用</translation>
    </message>
    <message>
        <source>Add...</source>
        <translation>添加...</translation>
    </message>
    <message>
        <source>Change...</source>
        <translation>更改...</translation>
    </message>
    <message>
        <source>Close</source>
        <translation>关闭</translation>
    </message>
    <message>
        <source>Keep</source>
        <translation>保存</translation>
    </message>
    <message>
        <source>Leave it</source>
        <translation>不保存</translation>
    </message>
    <message>
        <source>Why, for the archive</source>
        <translation>更改理由（录入档案库）</translation>
    </message>
</context>
<context>
    <name>LimitsDialog</name>
    <message>
        <source>Limits of the station</source>
        <translation>工位的限值</translation>
    </message>
    <message>
        <source>What lies beyond them, only a supervisor can accept, with a reason. Each change is kept with name and time.</source>
        <translation>超出限值的，只有主管说明理由后才能接受。每次更改都连同姓名和时间保存。</translation>
    </message>
    <message>
        <source>Sign with the supervisor&apos;s password.</source>
        <translation>用主管密码签名。</translation>
    </message>
    <message>
        <source>There is no password yet: the one that you type becomes the supervisor&apos;s. From then on it is asked for.</source>
        <translation>尚无密码：您输入的密码将成为主管密码，此后都会要求输入。</translation>
    </message>
    <message>
        <source>Lay down</source>
        <translation>规定</translation>
    </message>
    <message>
        <source>Close</source>
        <translation>关闭</translation>
    </message>
    <message>
        <source>New password, or nothing to keep it</source>
        <translation>新密码；留空则不变</translation>
    </message>
    <message>
        <source>Swing: U (k = 2) at most</source>
        <translation>摆动：U (k = 2) 最大</translation>
    </message>
    <message>
        <source>Swing: images at least</source>
        <translation>摆动：图像至少</translation>
    </message>
    <message>
        <source>Swing: images at most</source>
        <translation>摆动：图像至多</translation>
    </message>
    <message>
        <source>Fixed point: std across the view</source>
        <translation>固定点：垂直于视线的标准差</translation>
    </message>
    <message>
        <source>Fixed point: std along the view</source>
        <translation>固定点：沿视线的标准差</translation>
    </message>
    <message>
        <source>Ring: error of the radius</source>
        <translation>圆环：半径误差</translation>
    </message>
    <message>
        <source>Ring: roundness, and off its plane</source>
        <translation>圆环：圆度及偏离平面</translation>
    </message>
    <message>
        <source>Length: error</source>
        <translation>长度：误差</translation>
    </message>
    <message>
        <source>Location error</source>
        <translation>位置误差</translation>
    </message>
    <message>
        <source>Repeatability: std of the tip</source>
        <translation>重复性：测头标准差</translation>
    </message>
    <message>
        <source>Drift of a witness</source>
        <translation>监视点的漂移</translation>
    </message>
    <message>
        <source>Tips: days in force at most</source>
        <translation>测头：最长有效天数</translation>
    </message>
    <message>
        <source>Tips: swings of their pen at most</source>
        <translation>测头：其光笔的最多摆动次数</translation>
    </message>
    <message>
        <source>any number</source>
        <translation>不限</translation>
    </message>
    <message>
        <source>Usual: {0}.</source>
        <translation>通常：{0}。</translation>
    </message>
</context>
<context>
    <name>LimitsForm</name>
    <message>
        <source>Limits of the swing</source>
        <translation>摆动限值</translation>
    </message>
    <message>
        <source>All limits...</source>
        <translation>所有限值...</translation>
    </message>
    <message>
        <source>Those of verifications, too; a supervisor lays them down.</source>
        <translation>包括验证的限值；由主管规定。</translation>
    </message>
    <message>
        <source>U (k = 2) at most</source>
        <translation>U (k = 2) 上限</translation>
    </message>
    <message>
        <source>Images at least</source>
        <translation>最少图像数</translation>
    </message>
    <message>
        <source>Images at most</source>
        <translation>最多图像数</translation>
    </message>
    <message>
        <source>The swing ends when the tip is as certain as this along its weakest direction. Usual: {0} mm.</source>
        <translation>测头在最弱方向上达到此不确定度时，摆动结束。通常：{0} mm。</translation>
    </message>
    <message>
        <source>The swing does not end with fewer; no more than the images at most. Usual: {0}.</source>
        <translation>少于此数时摆动不会结束；不得大于最多图像数。通常：{0}。</translation>
    </message>
    <message>
        <source>The swing ends with so many in any case; no fewer than the images at least. Usual: {0}.</source>
        <translation>达到此数时摆动必定结束；不得小于最少图像数。通常：{0}。</translation>
    </message>
</context>
<context>
    <name>LivePanel</name>
    <message>
        <source>Wheel or + and - enlarge, arrow keys move, 0 shows all.</source>
        <translation>滚轮或 + 和 - 缩放，方向键移动，0 显示全图。</translation>
    </message>
    <message>
        <source>Connecting</source>
        <translation>正在连接</translation>
    </message>
    <message>
        <source>Live</source>
        <translation>实时</translation>
    </message>
    <message>
        <source>Silent</source>
        <translation>无图像</translation>
    </message>
    <message>
        <source>Lost, reconnecting</source>
        <translation>连接中断，正在重连</translation>
    </message>
    <message>
        <source>Not connected</source>
        <translation>未连接</translation>
    </message>
    <message>
        <source>The camera is being opened.</source>
        <translation>正在打开相机。</translation>
    </message>
    <message>
        <source>The first image is on its way.</source>
        <translation>正在等待第一幅图像。</translation>
    </message>
    <message>
        <source>The camera answers but sends no images. Check its trigger and its cable.</source>
        <translation>相机有响应但没有送来图像。请检查触发和电缆。</translation>
    </message>
    <message>
        <source>{0} It is looked for until it is back.</source>
        <translation>{0} 程序会持续查找，直到恢复。</translation>
    </message>
    <message>
        <source>{0} x {1} px</source>
        <translation>{0} × {1} px</translation>
    </message>
    <message>
        <source>{0} images/s</source>
        <translation>{0} 幅/秒</translation>
    </message>
    <message>
        <source>lost: {0}</source>
        <translation>丢失：{0}</translation>
    </message>
    <message>
        <source>bright spots: {0}</source>
        <translation>亮点：{0}</translation>
    </message>
    <message>
        <source>{0} of {1} LEDs</source>
        <translation>{0} / {1} 个 LED</translation>
    </message>
    <message>
        <source>, other spots: {0}</source>
        <translation>，其他光点：{0}</translation>
    </message>
</context>
<context>
    <name>LiveView</name>
    <message>
        <source>Camera {0}: {1}</source>
        <translation>相机 {0}：{1}</translation>
    </message>
</context>
<context>
    <name>MainWindow</name>
    <message>
        <source>The data folder is chosen at the step Start, or in the options (F10).</source>
        <translation>数据文件夹可在“开始”步骤或选项 (F10) 中选择。</translation>
    </message>
    <message>
        <source>The program made a mistake of its own and goes on. All images taken so far are safe. Please send this report to its makers: {0}</source>
        <translation>程序自身出错，但会继续运行。已采集的图像全部安全。请将此报告发给开发者：{0}</translation>
    </message>
    <message>
        <source>The program made a mistake of its own and goes on. All images taken so far are safe. No report could be written: the disk is full or not yours to write.</source>
        <translation>程序自身出错，但会继续运行。已采集的图像全部安全。无法写入报告：磁盘已满或没有写入权限。</translation>
    </message>
    <message>
        <source>Press this button at the screen.</source>
        <translation>请在屏幕前按此按钮。</translation>
    </message>
    <message>
        <source>Sounds are off.</source>
        <translation>声音已关闭。</translation>
    </message>
    <message>
        <source>Sounds are on.</source>
        <translation>声音已打开。</translation>
    </message>
    <message>
        <source>Data folder</source>
        <translation>数据文件夹</translation>
    </message>
    <message>
        <source>Swings and results are kept in {0} from the next start of the program on. Those of now stay where they are.</source>
        <translation>从下次启动起，摆动记录和结果保存在 {0}。现有的仍留在原处。</translation>
    </message>
    <message>
        <source>Stay</source>
        <translation>不关闭</translation>
    </message>
    <message>
        <source>Close anyway</source>
        <translation>仍然关闭</translation>
    </message>
    <message>
        <source>Pen tip calibration</source>
        <translation>光笔测头标定</translation>
    </message>
</context>
<context>
    <name>MatchPanel</name>
    <message>
        <source>Live match</source>
        <translation>实时匹配</translation>
    </message>
    <message>
        <source>Wheel or + and - enlarge, arrow keys move, 0 shows all.</source>
        <translation>滚轮或 + 和 - 缩放，方向键移动，0 显示全图。</translation>
    </message>
    <message>
        <source>No image comes yet.</source>
        <translation>还没有图像。</translation>
    </message>
    <message>
        <source>No match yet</source>
        <translation>尚无匹配</translation>
    </message>
    <message>
        <source>Swing under way</source>
        <translation>摆动进行中</translation>
    </message>
    <message>
        <source>Rings: by its LED file</source>
        <translation>圆环：按其 LED 文件</translation>
    </message>
    <message>
        <source>Pen not found</source>
        <translation>未找到光笔</translation>
    </message>
    <message>
        <source>{0} of {1} LEDs</source>
        <translation>{0} / {1} 个 LED</translation>
    </message>
    <message>
        <source>misfit {0} px</source>
        <translation>拟合误差 {0} px</translation>
    </message>
    <message>
        <source>Lean and turn the pen, so that it is seen from all sides.</source>
        <translation>倾斜并转动光笔，让相机从各个方向看到它。</translation>
    </message>
    <message>
        <source>The LEDs fit the images, but not the pen frame: see what is told of the file.</source>
        <translation>LED 与图像相符，但不符合光笔坐标系：请看文件处的说明。</translation>
    </message>
    <message>
        <source>Every LED is within {0} mm of its place in the table, in {1} views.</source>
        <translation>在 {1} 个视角中，每个 LED 与表中位置相差均不超过 {0} mm。</translation>
    </message>
    <message>
        <source>{0} of LEDs {1} and {2} are exchanged in the table.</source>
        <translation>表格中 LED {1} 和 {2} 的 {0} 互换了。</translation>
    </message>
    <message>
        <source>LED {0} sits {1} mm off its place: {2}, {3}, {4} mm.</source>
        <translation>LED {0} 偏离位置 {1} mm：{2}, {3}, {4} mm。</translation>
    </message>
    <message>
        <source>LED {0} sits off its place. Lean and turn the pen to see by how much.</source>
        <translation>LED {0} 偏离位置。倾斜并转动光笔，以确定偏离多少。</translation>
    </message>
    <message>
        <source>LED {0} or {1} sits off its place, by {2} mm.</source>
        <translation>LED {0} 或 {1} 偏离位置 {2} mm。</translation>
    </message>
    <message>
        <source>LED {0} is not seen where the table has it. A finger may cover it, it is off, or its place is wrong.</source>
        <translation>在表格给出的位置看不到 LED {0}。可能被手指遮住、没有点亮，或位置有误。</translation>
    </message>
    <message>
        <source>A light at {0}, {1}, {2} mm moves with the pen. Is an LED missing in the table?</source>
        <translation>位于 {0}, {1}, {2} mm 的光点随光笔移动。表格中是否缺少一个 LED？</translation>
    </message>
    <message>
        <source>The LEDs fit to {0} px, {1} px or less is usual. Is this the LED file of this pen, and the intrinsics file of this camera and lens?</source>
        <translation>LED 拟合误差为 {0} px，通常不超过 {1} px。LED 文件是否属于本光笔，内参文件是否属于这台相机和镜头？</translation>
    </message>
</context>
<context>
    <name>MendableRemark</name>
    <message>
        <source>Exchange {0} and {1}</source>
        <translation>交换 {0} 和 {1}</translation>
    </message>
    <message>
        <source>Use the measured place</source>
        <translation>采用测得的位置</translation>
    </message>
</context>
<context>
    <name>MethodsPanel</name>
    <message>
        <source>Objective / mm²</source>
        <translation>目标函数 / mm²</translation>
    </message>
    <message>
        <source>iteration</source>
        <translation>迭代次数</translation>
    </message>
    <message>
        <source>Tip minus its end / µm</source>
        <translation>测头与终值之差 / µm</translation>
    </message>
    <message>
        <source>Two-stage method beside the joint fit</source>
        <translation>两步法与联合拟合的比较</translation>
    </message>
    <message>
        <source>Joint fit</source>
        <translation>联合拟合</translation>
    </message>
    <message>
        <source>its U (k = 2)</source>
        <translation>其 U (k = 2)</translation>
    </message>
    <message>
        <source>Two-stage (paper)</source>
        <translation>两步法（论文）</translation>
    </message>
    <message>
        <source>its U, of noise alone</source>
        <translation>其 U，仅含噪声</translation>
    </message>
    <message>
        <source>difference</source>
        <translation>差值</translation>
    </message>
    <message>
        <source>rms / mm</source>
        <translation>均方根 / mm</translation>
    </message>
</context>
<context>
    <name>MonteCarloRow</name>
    <message>
        <source>Check by Monte Carlo</source>
        <translation>用蒙特卡洛法检验</translation>
    </message>
    <message>
        <source>Draw files, seat and noise as U counts them, and calibrate from each (JCGM 101). It takes all cores but one for some seconds to minutes.</source>
        <translation>按 U 的计入方式抽取文件、落座和噪声，并逐次重新标定（JCGM 101）。将占用除一个以外的所有处理器核心，历时数秒至数分钟。</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>取消</translation>
    </message>
    <message>
        <source>Trials</source>
        <translation>试验次数</translation>
    </message>
    <message>
        <source>Progress</source>
        <translation>进度</translation>
    </message>
    <message>
        <source>U by Monte Carlo beside the budget</source>
        <translation>蒙特卡洛法与不确定度预算的 U 对照</translation>
    </message>
    <message>
        <source>It is for the swing of one camera.</source>
        <translation>仅适用于单相机的摆动。</translation>
    </message>
    <message>
        <source>{0} trials gave a tip, {1} did not.</source>
        <translation>{0} 次试验求得测头中心，{1} 次未求得。</translation>
    </message>
    <message>
        <source>U (k = 2) by Monte Carlo / µm</source>
        <translation>蒙特卡洛法的 U (k = 2) / µm</translation>
    </message>
    <message>
        <source>known to (k = 1) / µm</source>
        <translation>其自身精度 (k = 1) / µm</translation>
    </message>
    <message>
        <source>U (k = 2) by the budget / µm</source>
        <translation>预算的 U (k = 2) / µm</translation>
    </message>
    <message>
        <source>budget less Monte Carlo, in what so many trials know</source>
        <translation>预算减蒙特卡洛，以其自身精度为单位</translation>
    </message>
</context>
<context>
    <name>NamesForm</name>
    <message>
        <source>List of pens</source>
        <translation>光笔列表</translation>
    </message>
    <message>
        <source>List of tips</source>
        <translation>测头列表</translation>
    </message>
    <message>
        <source>List of cones</source>
        <translation>锥孔列表</translation>
    </message>
    <message>
        <source>Choose from the tip library, or open it. Key: arrow down</source>
        <translation>从测头库中选择，或打开测头库。按键：向下箭头</translation>
    </message>
    <message>
        <source>Where and who</source>
        <translation>工位与人员</translation>
    </message>
    <message>
        <source>What is calibrated</source>
        <translation>标定对象</translation>
    </message>
    <message>
        <source>Station</source>
        <translation>工位</translation>
    </message>
    <message>
        <source>Operator</source>
        <translation>操作员</translation>
    </message>
    <message>
        <source>Pen, serial number</source>
        <translation>光笔序列号</translation>
    </message>
    <message>
        <source>Cone</source>
        <translation>锥孔</translation>
    </message>
    <message>
        <source>Probe tip</source>
        <translation>测头</translation>
    </message>
    <message>
        <source>Ball diameter</source>
        <translation>测球直径</translation>
    </message>
    <message>
        <source>Nominal centre of the tip</source>
        <translation>测头标称中心</translation>
    </message>
    <message>
        <source>Choose a station to bring back all that was chosen there, or type the name of a new one.</source>
        <translation>选择已有工位可恢复其全部设置；也可输入新工位的名称。</translation>
    </message>
    <message>
        <source>not known</source>
        <translation>未知</translation>
    </message>
</context>
<context>
    <name>NewcomerPanel</name>
    <message>
        <source>New here?</source>
        <translation>第一次使用？</translation>
    </message>
    <message>
        <source>No pen and no camera are needed to see how it goes. What is simulated is kept apart from real tips.</source>
        <translation>无需光笔和相机即可了解流程。模拟结果与真实测头分开保存。</translation>
    </message>
    <message>
        <source>Try it with a simulated pen</source>
        <translation>用模拟光笔试一试</translation>
    </message>
    <message>
        <source>What is this?</source>
        <translation>这是什么？</translation>
    </message>
    <message>
        <source>Play the demo</source>
        <translation>播放演示</translation>
    </message>
    <message>
        <source>In another window, which goes through all steps by itself.</source>
        <translation>在另一个窗口中自动走完所有步骤。</translation>
    </message>
</context>
<context>
    <name>NextTipsRow</name>
    <message>
        <source>Next tip</source>
        <translation>下一个测头</translation>
    </message>
    <message>
        <source>Next tip {0}</source>
        <translation>下一个测头 {0}</translation>
    </message>
    <message>
        <source>Calibrate tip {0} next, with its ball and nominal centre</source>
        <translation>接着标定测头 {0}，并采用其测球直径和标称中心</translation>
    </message>
</context>
<context>
    <name>NoticeBar</name>
    <message>
        <source>Close</source>
        <translation>关闭</translation>
    </message>
</context>
<context>
    <name>OperatorView</name>
    <message>
        <source>Operator view</source>
        <translation>操作员视图</translation>
    </message>
    <message>
        <source>Esc: leave this view</source>
        <translation>Esc：退出此视图</translation>
    </message>
</context>
<context>
    <name>OptionsMenu</name>
    <message>
        <source>As the system</source>
        <translation>跟随系统</translation>
    </message>
    <message>
        <source>Light</source>
        <translation>浅色</translation>
    </message>
    <message>
        <source>Dark</source>
        <translation>深色</translation>
    </message>
    <message>
        <source>{0} m</source>
        <translation>{0} 米</translation>
    </message>
    <message>
        <source>Language</source>
        <translation>语言</translation>
    </message>
    <message>
        <source>Appearance</source>
        <translation>外观</translation>
    </message>
    <message>
        <source>Viewing distance</source>
        <translation>观看距离</translation>
    </message>
    <message>
        <source>Mute the sounds</source>
        <translation>关闭声音</translation>
    </message>
    <message>
        <source>Data folder...</source>
        <translation>数据文件夹...</translation>
    </message>
    <message>
        <source>Live stream...</source>
        <translation>实时数据流...</translation>
    </message>
    <message>
        <source>About Lightpen</source>
        <translation>关于 Lightpen</translation>
    </message>
</context>
<context>
    <name>PaperWindow</name>
    <message>
        <source>Record on paper</source>
        <translation>纸质记录</translation>
    </message>
    <message>
        <source>Pages</source>
        <translation>页面</translation>
    </message>
    <message>
        <source>Smaller</source>
        <translation>缩小</translation>
    </message>
    <message>
        <source>Larger</source>
        <translation>放大</translation>
    </message>
    <message>
        <source>Save as PDF...</source>
        <translation>另存为 PDF...</translation>
    </message>
    <message>
        <source>Print...</source>
        <translation>打印...</translation>
    </message>
    <message>
        <source>Save the record on paper</source>
        <translation>保存纸质记录</translation>
    </message>
</context>
<context>
    <name>PenInSpace</name>
    <message>
        <source>The pen in space</source>
        <translation>光笔的空间姿态</translation>
    </message>
    <message>
        <source>The pen as it leans, and the outline of where it should go.</source>
        <translation>光笔当前的倾斜，以及应到位置的轮廓。</translation>
    </message>
</context>
<context>
    <name>PenPanel</name>
    <message>
        <source>Improve the LED file</source>
        <translation>改进 LED 文件</translation>
    </message>
    <message>
        <source>Pool the newest swings; the last one has to confirm what comes of them. The old file stays.</source>
        <translation>合并最近的几次摆动，并须由最后一次加以证实。旧文件保留不变。</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>取消</translation>
    </message>
    <message>
        <source>Use the new file</source>
        <translation>使用新文件</translation>
    </message>
    <message>
        <source>Progress</source>
        <translation>进度</translation>
    </message>
    <message>
        <source>LEDs since the first swing / µm, size of the pen / ppm</source>
        <translation>自首次摆动以来各 LED 的位移 / µm，光笔尺寸变化 / ppm</translation>
    </message>
    <message>
        <source>LEDs since the first swing / mm</source>
        <translation>自首次摆动以来各 LED 的位移 / mm</translation>
    </message>
    <message>
        <source>swing no.</source>
        <translation>摆动序号</translation>
    </message>
    <message>
        <source>The swings of the pen are being read.</source>
        <translation>正在读取该光笔的摆动。</translation>
    </message>
    <message>
        <source>Two accepted swings with this LED file are needed to tell how pen {0} changes; there are {1}.</source>
        <translation>判断光笔 {0} 的变化需要两次使用此 LED 文件并已接受的摆动，目前有 {1} 次。</translation>
    </message>
    <message>
        <source>Swings with another LED file, or that cannot be read: {0}.</source>
        <translation>使用其他 LED 文件或无法读取的摆动：{0} 次。</translation>
    </message>
    <message>
        <source>Nothing is read yet.</source>
        <translation>尚未读取任何内容。</translation>
    </message>
    <message>
        <source>It takes four accepted swings with this LED file and camera file; {0} more.</source>
        <translation>需要四次使用此 LED 文件和相机文件并已接受的摆动，还差 {0} 次。</translation>
    </message>
    <message>
        <source>An LED has moved: no file is right for all swings.</source>
        <translation>有 LED 发生了移位：没有一个文件适用于所有摆动。</translation>
    </message>
    <message>
        <source>Written as {0}: the swing held out fits it to {1} px, the old file to {2} px. A tip belongs to its LED file: calibrate again with the new one.</source>
        <translation>已写入 {0}：留出的摆动与新文件相差 {1} px，与旧文件相差 {2} px。测头与其 LED 文件对应：请用新文件重新标定。</translation>
    </message>
    <message>
        <source>size</source>
        <translation>尺寸</translation>
    </message>
</context>
<context>
    <name>PenView</name>
    <message>
        <source>The LEDs appear here.</source>
        <translation>LED 显示在这里。</translation>
    </message>
    <message>
        <source>tip</source>
        <translation>测头</translation>
    </message>
    <message>
        <source>The LEDs in space</source>
        <translation>LED 空间视图</translation>
    </message>
    <message>
        <source>{0} LEDs</source>
        <translation>{0} 个 LED</translation>
    </message>
    <message>
        <source>Drag the mouse or press the arrow keys to turn it, 0 to reset.</source>
        <translation>拖动鼠标或按方向键转动，按 0 复位。</translation>
    </message>
</context>
<context>
    <name>PlotCard</name>
    <message>
        <source>Saved as {0}</source>
        <translation>已保存为 {0}</translation>
    </message>
    <message>
        <source>Save plot</source>
        <translation>保存图表</translation>
    </message>
    <message>
        <source>Enlarge</source>
        <translation>放大</translation>
    </message>
    <message>
        <source>Save picture (PNG)</source>
        <translation>保存图片 (PNG)</translation>
    </message>
    <message>
        <source>Save numbers (CSV)</source>
        <translation>保存数据 (CSV)</translation>
    </message>
    <message>
        <source>Enlarge or save this plot</source>
        <translation>放大或保存此图表</translation>
    </message>
</context>
<context>
    <name>PointField</name>
    <message>
        <source>As in the LED file</source>
        <translation>同 LED 文件</translation>
    </message>
    <message>
        <source>As in the LED file: {0} mm</source>
        <translation>同 LED 文件：{0} mm</translation>
    </message>
    <message>
        <source>Nominal centre of the tip, {0}</source>
        <translation>测头标称中心 {0}</translation>
    </message>
</context>
<context>
    <name>PostureDial</name>
    <message>
        <source>Postures</source>
        <translation>姿态</translation>
    </message>
    <message>
        <source>{0} of {1} postures are done.</source>
        <translation>{1} 个姿态中已完成 {0} 个。</translation>
    </message>
    <message>
        <source>camera</source>
        <translation>相机</translation>
    </message>
    <message>
        <source>turn about the pen&apos;s own axis</source>
        <translation>绕光笔自身轴线转动</translation>
    </message>
</context>
<context>
    <name>ResidualView</name>
    <message>
        <source>Recorded image</source>
        <translation>记录的图像</translation>
    </message>
</context>
<context>
    <name>ResidualsPanel</name>
    <message>
        <source>Residuals × {0}</source>
        <translation>残差 × {0}</translation>
    </message>
    <message>
        <source>x / px</source>
        <translation>x / px</translation>
    </message>
    <message>
        <source>y / px</source>
        <translation>y / px</translation>
    </message>
    <message>
        <source>By axis / px</source>
        <translation>按坐标轴 / px</translation>
    </message>
    <message>
        <source>By LED / px</source>
        <translation>按 LED / px</translation>
    </message>
    <message>
        <source>LED</source>
        <translation>LED</translation>
    </message>
    <message>
        <source>rms</source>
        <translation>均方根</translation>
    </message>
    <message>
        <source>mean x</source>
        <translation>x 均值</translation>
    </message>
    <message>
        <source>mean y</source>
        <translation>y 均值</translation>
    </message>
    <message>
        <source>Beside the normal curve</source>
        <translation>与正态曲线比较</translation>
    </message>
    <message>
        <source>residual / px</source>
        <translation>残差 / px</translation>
    </message>
    <message>
        <source>count</source>
        <translation>数量</translation>
    </message>
    <message>
        <source>The arrows should look random. A pattern points to the intrinsics file, one LED that stands out to the LED file.</source>
        <translation>箭头应随机分布。若有规律，请检查内参文件；若某个 LED 突出，请检查 LED 文件。</translation>
    </message>
</context>
<context>
    <name>ResultPanel</name>
    <message>
        <source>Tip in the frame of the pen / mm, with U (k = 2)</source>
        <translation>光笔坐标系中的测头 / mm，含 U (k = 2)</translation>
    </message>
    <message>
        <source>Differences / µm</source>
        <translation>差值 / µm</translation>
    </message>
    <message>
        <source>Differences</source>
        <translation>差值</translation>
    </message>
    <message>
        <source>Postures of the images that are used</source>
        <translation>所用图像的姿态</translation>
    </message>
    <message>
        <source>{0} of {1} images used</source>
        <translation>使用 {0} / {1} 幅图像</translation>
    </message>
    <message>
        <source>Tip {0} in the frame of pen {1} / mm, U&#xa0;(k&#xa0;=&#xa0;2)</source>
        <translation>测头 {0}（光笔 {1} 坐标系）/ mm，U&#xa0;(k&#xa0;=&#xa0;2)</translation>
    </message>
    <message>
        <source>its U (k = 2)</source>
        <translation>其 U (k = 2)</translation>
    </message>
    <message>
        <source>no earlier result</source>
        <translation>无更早结果</translation>
    </message>
    <message>
        <source>since {0}</source>
        <translation>与 {0} 相比</translation>
    </message>
    <message>
        <source>no nominal tip</source>
        <translation>无标称测头</translation>
    </message>
    <message>
        <source>since nominal</source>
        <translation>与标称相比</translation>
    </message>
    <message>
        <source>odd - even</source>
        <translation>奇数 - 偶数</translation>
    </message>
    <message>
        <source>As found: {0} mm off; the tip has no limit of change</source>
        <translation>标定前状态：偏差 {0} mm；该测头没有变化限值</translation>
    </message>
    <message>
        <source>As found: {0} mm off, limit {1} mm</source>
        <translation>标定前状态：偏差 {0} mm，限值 {1} mm</translation>
    </message>
    <message>
        <source>Odd and even images agree</source>
        <translation>奇数与偶数图像一致</translation>
    </message>
    <message>
        <source>Odd and even images differ by more than chance</source>
        <translation>奇数与偶数图像的差异超出随机范围</translation>
    </message>
</context>
<context>
    <name>ResultTools</name>
    <message>
        <source>Open the folder of the swing</source>
        <translation>打开本次摆动的文件夹</translation>
    </message>
    <message>
        <source>Copy x, y, z in mm, parted by tabs</source>
        <translation>复制 x、y、z（mm，以制表符分隔）</translation>
    </message>
    <message>
        <source>Save results and plots under the name of pen, tip and date</source>
        <translation>以光笔、测头和日期命名，保存结果和图</translation>
    </message>
    <message>
        <source>Look at it, save it as PDF, or print it</source>
        <translation>预览、另存为 PDF 或打印</translation>
    </message>
    <message>
        <source>Record on paper...</source>
        <translation>纸质记录...</translation>
    </message>
    <message>
        <source>Open folder</source>
        <translation>打开文件夹</translation>
    </message>
    <message>
        <source>Copy the tip</source>
        <translation>复制测头坐标</translation>
    </message>
    <message>
        <source>Save...</source>
        <translation>保存...</translation>
    </message>
    <message>
        <source>All at once...</source>
        <translation>全部一次保存...</translation>
    </message>
    <message>
        <source>Record (JSON)...</source>
        <translation>记录（JSON）...</translation>
    </message>
    <message>
        <source>Tip and images (CSV)...</source>
        <translation>测头和图像（CSV）...</translation>
    </message>
    <message>
        <source>All plots (PNG)...</source>
        <translation>全部图（PNG）...</translation>
    </message>
</context>
<context>
    <name>ReviewPage</name>
    <message>
        <source>Review</source>
        <translation>复核</translation>
    </message>
    <message>
        <source>Next: start the next calibration, or close the program.</source>
        <translation>下一步：开始下一次标定，或关闭程序。</translation>
    </message>
    <message>
        <source>Nothing is in force until it is accepted.</source>
        <translation>接受之前，结果不会生效。</translation>
    </message>
    <message>
        <source>{0} The old one stays in force until then.</source>
        <translation>{0}在此之前旧数据一直有效。</translation>
    </message>
    <message>
        <source>Swing the pen first.</source>
        <translation>请先摆动光笔。</translation>
    </message>
    <message>
        <source>Start the next calibration</source>
        <translation>开始下一次标定</translation>
    </message>
    <message>
        <source>Accept</source>
        <translation>接受</translation>
    </message>
    <message>
        <source>Check the files</source>
        <translation>检查文件</translation>
    </message>
    <message>
        <source>The tip is not accepted. The swing is kept and offered again at the next start.</source>
        <translation>测头尚未接受。本次摆动已保留，下次启动时会再次列出。</translation>
    </message>
    <message>
        <source>Images</source>
        <translation>图像</translation>
    </message>
    <message>
        <source>Residuals</source>
        <translation>残差</translation>
    </message>
    <message>
        <source>Uncertainty</source>
        <translation>不确定度</translation>
    </message>
    <message>
        <source>Two-stage</source>
        <translation>两步法</translation>
    </message>
    <message>
        <source>Result</source>
        <translation>结果</translation>
    </message>
    <message>
        <source>Details</source>
        <translation>详细信息</translation>
    </message>
    <message>
        <source>Progress of the computation</source>
        <translation>计算进度</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>取消</translation>
    </message>
    <message>
        <source>Keep the last solution</source>
        <translation>保留上次的解</translation>
    </message>
    <message>
        <source>Capture more</source>
        <translation>继续采集</translation>
    </message>
    <message>
        <source>Repeat</source>
        <translation>重做</translation>
    </message>
    <message>
        <source>Since {0}, to be checked; accepted with the reason: {1}</source>
        <translation>自 {0} 起，需检查；接受理由：{1}</translation>
    </message>
    <message>
        <source>This swing is of tip {0}, pen {1}, whatever the step Start names now: tip {2}, pen {3}.</source>
        <translation>本次摆动属于测头 {0}、光笔 {1}；“开始”步骤现在填写的是测头 {2}、光笔 {3}。</translation>
    </message>
    <message>
        <source>Repeat the swing from the start? These images stay on the disk.</source>
        <translation>从头重做摆动吗？这些图像仍保留在磁盘上。</translation>
    </message>
    <message>
        <source>Go on with these</source>
        <translation>沿用这些图像</translation>
    </message>
    <message>
        <source>The tip is being computed.</source>
        <translation>正在计算测头。</translation>
    </message>
    <message>
        <source>Next: record more images, and read them all again.</source>
        <translation>下一步：补录图像，然后重新读取全部图像。</translation>
    </message>
    <message>
        <source>The tip is accepted.</source>
        <translation>测头已接受。</translation>
    </message>
    <message>
        <source>Check the settings</source>
        <translation>检查设置</translation>
    </message>
    <message>
        <source>The tip was taken back and is not accepted. The swing is kept; the file swing.lightpen in {0} opens it again.</source>
        <translation>测头已撤回，未被接受。摆动数据已保留；{0} 中的 swing.lightpen 文件可重新打开。</translation>
    </message>
    <message>
        <source>Accept...</source>
        <translation>接受...</translation>
    </message>
    <message>
        <source>Verify it</source>
        <translation>验证</translation>
    </message>
    <message>
        <source>Prove the tip in minutes by touching what is known.</source>
        <translation>触测已知的标准件，几分钟内即可验证测头。</translation>
    </message>
    <message>
        <source>Take back...</source>
        <translation>撤回...</translation>
    </message>
    <message>
        <source>Put the result before in force again; both are kept.</source>
        <translation>使之前的结果重新生效；两者都保留。</translation>
    </message>
    <message>
        <source>The tip is to be checked. Why is it accepted nevertheless? The reason is stored with it.</source>
        <translation>该测头需检查。为何仍要接受？理由将随结果保存。</translation>
    </message>
    <message>
        <source>Reason</source>
        <translation>理由</translation>
    </message>
    <message>
        <source>Accept with this reason</source>
        <translation>按此理由接受</translation>
    </message>
    <message>
        <source>Do not accept</source>
        <translation>不接受</translation>
    </message>
    <message>
        <source>The swing goes on.</source>
        <translation>摆动继续进行。</translation>
    </message>
    <message>
        <source>The result is being stored.</source>
        <translation>正在保存结果。</translation>
    </message>
    <message>
        <source>Not good enough: capture more images, or repeat the swing.</source>
        <translation>结果不够好：请继续采集图像，或重做摆动。</translation>
    </message>
    <message>
        <source>The tip is accepted; start the next calibration.</source>
        <translation>测头已接受；请开始下一次标定。</translation>
    </message>
    <message>
        <source>All recorded images are read.</source>
        <translation>录制的图像已全部读取。</translation>
    </message>
    <message>
        <source>Add images to this swing</source>
        <translation>为本次摆动增加图像</translation>
    </message>
    <message>
        <source>Swing anew without these images</source>
        <translation>不用这些图像，重新摆动</translation>
    </message>
    <message>
        <source>Put it in force with a reason</source>
        <translation>注明理由后使其生效</translation>
    </message>
    <message>
        <source>Accept the tip first: it is of the result.</source>
        <translation>请先接受测头：纸质记录由已接受的结果生成。</translation>
    </message>
    <message>
        <source>Since {0}. Earlier results are kept.</source>
        <translation>自 {0} 起。更早的结果均保留。</translation>
    </message>
    <message>
        <source>Take this acceptance back? The result before is in force again; both are kept.</source>
        <translation>撤回此次接受吗？之前的结果将重新生效；两者都保留。</translation>
    </message>
    <message>
        <source>Take back</source>
        <translation>撤回</translation>
    </message>
    <message>
        <source>Leave it in force</source>
        <translation>保持生效</translation>
    </message>
    <message>
        <source>The tip shows here once the pen is swung.</source>
        <translation>摆动光笔后，测头显示在这里。</translation>
    </message>
    <message>
        <source>NO TIP YET</source>
        <translation>尚无结果</translation>
    </message>
    <message>
        <source>{0}: {1}</source>
        <translation>{0}：{1}</translation>
    </message>
</context>
<context>
    <name>RigPanel</name>
    <message>
        <source>Rig file of both cameras</source>
        <translation>两台相机的相机组文件</translation>
    </message>
    <message>
        <source>Rig files ({0})</source>
        <translation>相机组文件 ({0})</translation>
    </message>
    <message>
        <source>Two cameras at once</source>
        <translation>两台相机同时观测</translation>
    </message>
    <message>
        <source>A second camera looks at the pen, too</source>
        <translation>第二台相机同时观测光笔</translation>
    </message>
    <message>
        <source>Rig file</source>
        <translation>相机组文件</translation>
    </message>
    <message>
        <source>Open...</source>
        <translation>打开...</translation>
    </message>
    <message>
        <source>Open the file that says where both cameras stand. &quot;lightpen extrinsics LEFT RIGHT --board BOARD --out rig.json&quot; makes it from images of one board.</source>
        <translation>请打开说明两台相机位置的文件。该文件可由同一标定板的图像生成：&quot;lightpen extrinsics LEFT RIGHT --board BOARD --out rig.json&quot;。</translation>
    </message>
    <message>
        <source>{0} and {1} stand {2} mm apart</source>
        <translation>{0} 与 {1} 相距 {2} mm</translation>
    </message>
    <message>
        <source>{0} stays in use: {1}</source>
        <translation>{0} 仍在使用：{1}</translation>
    </message>
    <message>
        <source>Both take their images at the same moment.</source>
        <translation>两台相机同步曝光。</translation>
    </message>
    <message>
        <source>{0} Images without a partner: {1}.</source>
        <translation>{0} 未能配对的图像：{1} 幅。</translation>
    </message>
</context>
<context>
    <name>RingFinding</name>
    <message>
        <source>Radius of each run / mm</source>
        <translation>各轮的半径 / mm</translation>
    </message>
    <message>
        <source>Off the ring / mm</source>
        <translation>偏离圆环 / mm</translation>
    </message>
    <message>
        <source>Radius / mm</source>
        <translation>半径 / mm</translation>
    </message>
    <message>
        <source>Error / mm</source>
        <translation>误差 / mm</translation>
    </message>
    <message>
        <source>Relative error × 1e-4</source>
        <translation>相对误差 × 1e-4</translation>
    </message>
    <message>
        <source>U (k = 2) / mm</source>
        <translation>U (k = 2) / mm</translation>
    </message>
    <message>
        <source>Roundness / mm</source>
        <translation>圆度 / mm</translation>
    </message>
    <message>
        <source>Off the plane / mm</source>
        <translation>偏离平面 / mm</translation>
    </message>
    <message>
        <source>Covered / °</source>
        <translation>覆盖 / °</translation>
    </message>
    <message>
        <source>Touches</source>
        <translation>触测次数</translation>
    </message>
    <message>
        <source>Average</source>
        <translation>平均值</translation>
    </message>
</context>
<context>
    <name>RingStrip</name>
    <message>
        <source>in a groove</source>
        <translation>槽中</translation>
    </message>
    <message>
        <source>in its bore</source>
        <translation>孔内</translation>
    </message>
    <message>
        <source>from outside</source>
        <translation>外圆</translation>
    </message>
    <message>
        <source>not known</source>
        <translation>未知</translation>
    </message>
    <message>
        <source>Touch a ring</source>
        <translation>触测圆环</translation>
    </message>
    <message>
        <source>Certified radius</source>
        <translation>证书半径</translation>
    </message>
    <message>
        <source>Its U (k = 2)</source>
        <translation>其 U (k = 2)</translation>
    </message>
    <message>
        <source>Touched</source>
        <translation>触测处</translation>
    </message>
    <message>
        <source>Runs</source>
        <translation>轮数</translation>
    </message>
</context>
<context>
    <name>RingView</name>
    <message>
        <source>of {0}°</source>
        <translation>共需 {0}°</translation>
    </message>
    <message>
        <source>Ring: {0} of {1} degrees by {2} touches</source>
        <translation>圆环：{2} 次触测覆盖 {0} 度，需 {1} 度</translation>
    </message>
</context>
<context>
    <name>SelectionPanel</name>
    <message>
        <source>Select two entries with a tip to compare them.</source>
        <translation>选择两个带测头数据的条目即可比较。</translation>
    </message>
    <message>
        <source>{0} and {1}</source>
        <translation>{0} 与 {1}</translation>
    </message>
    <message>
        <source>Earlier / mm</source>
        <translation>较早 / mm</translation>
    </message>
    <message>
        <source>Later / mm</source>
        <translation>较晚 / mm</translation>
    </message>
    <message>
        <source>Change / mm</source>
        <translation>变化 / mm</translation>
    </message>
    <message>
        <source>U (k = 2) / mm</source>
        <translation>U (k = 2) / mm</translation>
    </message>
    <message>
        <source>They are not of the same pen and tip.</source>
        <translation>二者不是同一光笔和测头。</translation>
    </message>
    <message>
        <source>The change is no more than both uncertainties explain.</source>
        <translation>变化未超出两者不确定度所能解释的范围。</translation>
    </message>
    <message>
        <source>Repeatability needs two calibrations of one tip.</source>
        <translation>重复性至少需要同一测头的两次标定。</translation>
    </message>
    <message>
        <source>Repeatability of the {0} that are selected</source>
        <translation>所选 {0} 次标定的重复性</translation>
    </message>
    <message>
        <source>Repeatability of all {0} of the trend</source>
        <translation>趋势中全部 {0} 次标定的重复性</translation>
    </message>
    <message>
        <source>Mean / mm</source>
        <translation>平均 / mm</translation>
    </message>
    <message>
        <source>Scatter / mm</source>
        <translation>标准差 / mm</translation>
    </message>
    <message>
        <source>Range / mm</source>
        <translation>极差 / mm</translation>
    </message>
    <message>
        <source>Stated U / mm</source>
        <translation>给出的 U / mm</translation>
    </message>
    <message>
        <source>A fixed point touched {0} times with the tip, {1}: scatter along u, v, w {2} mm, {3} mm to be expected.</source>
        <translation>用该测头触测固定点 {0} 次（{1}）：沿 u、v、w 的散布为 {2} mm，预期为 {3} mm。</translation>
    </message>
</context>
<context>
    <name>SettingsPanel</name>
    <message>
        <source>The whole sensor is read out.</source>
        <translation>已读出整个传感器。</translation>
    </message>
    <message>
        <source>Colours are made grey, which costs sharpness. A grey format such as Mono8 gives better centres, a monochrome camera the best.</source>
        <translation>彩色会转换为灰度，清晰度因此下降。Mono8 等灰度格式的中心更准，黑白相机最好。</translation>
    </message>
    <message>
        <source>delivered: {0}</source>
        <translation>送达：{0}</translation>
    </message>
    <message>
        <source>incomplete: {0}</source>
        <translation>不完整：{0}</translation>
    </message>
    <message>
        <source>missed: {0}</source>
        <translation>丢失：{0}</translation>
    </message>
    <message>
        <source>skipped: {0}</source>
        <translation>跳过：{0}</translation>
    </message>
    <message>
        <source>Free running</source>
        <translation>自由运行</translation>
    </message>
    <message>
        <source>By software</source>
        <translation>软件触发</translation>
    </message>
    <message>
        <source>Settings of the camera</source>
        <translation>相机设置</translation>
    </message>
    <message>
        <source>Frame rate</source>
        <translation>帧率</translation>
    </message>
    <message>
        <source>Pixel format</source>
        <translation>像素格式</translation>
    </message>
    <message>
        <source>Trigger</source>
        <translation>触发</translation>
    </message>
    <message>
        <source>Packet size</source>
        <translation>数据包大小</translation>
    </message>
    <message>
        <source>Region width</source>
        <translation>区域宽度</translation>
    </message>
    <message>
        <source>Region from left</source>
        <translation>区域左边距</translation>
    </message>
    <message>
        <source>Region</source>
        <translation>区域</translation>
    </message>
    <message>
        <source>from left, top</source>
        <translation>左、上边距</translation>
    </message>
    <message>
        <source>Region height</source>
        <translation>区域高度</translation>
    </message>
    <message>
        <source>Region from top</source>
        <translation>区域上边距</translation>
    </message>
    <message>
        <source>Whole sensor</source>
        <translation>整个传感器</translation>
    </message>
    <message>
        <source>Of this camera&apos;s images: came whole; came in part and were left out; never came; were not measured, as the computer was too slow.</source>
        <translation>此相机的图像：完整送达；只到达一部分而被舍弃；从未到达；因计算机太慢而未测量。</translation>
    </message>
    <message>
        <source>Larger packets cost the computer less. The network card and every switch must let them pass (jumbo frames).</source>
        <translation>数据包越大，计算机的负担越小。网卡和每个交换机都必须允许其通过（巨型帧）。</translation>
    </message>
</context>
<context>
    <name>Sidebar</name>
    <message>
        <source>Live stream at {0}, listening: {1}</source>
        <translation>实时数据流 {0}，接收程序：{1}</translation>
    </message>
    <message>
        <source>Pen {0}</source>
        <translation>光笔 {0}</translation>
    </message>
    <message>
        <source>Tip {0}</source>
        <translation>测头 {0}</translation>
    </message>
    <message>
        <source>Cone {0}</source>
        <translation>锥孔 {0}</translation>
    </message>
    <message>
        <source>Pen tip calibration</source>
        <translation>光笔测头标定</translation>
    </message>
    <message>
        <source>Operator view</source>
        <translation>操作员视图</translation>
    </message>
    <message>
        <source>Help</source>
        <translation>帮助</translation>
    </message>
    <message>
        <source>Options</source>
        <translation>选项</translation>
    </message>
</context>
<context>
    <name>SoundTest</name>
    <message>
        <source>No sound here: {0}. All is shown in words and signs, too.</source>
        <translation>本机无声音：{0}。所有信息也以文字和符号显示。</translation>
    </message>
    <message>
        <source>Sounds are off. Press B to switch them on.</source>
        <translation>声音已关闭。按 B 打开。</translation>
    </message>
    <message>
        <source>Tip seated</source>
        <translation>测头就位</translation>
    </message>
    <message>
        <source>Image kept</source>
        <translation>保留图像</translation>
    </message>
    <message>
        <source>Field full</source>
        <translation>区域已满</translation>
    </message>
    <message>
        <source>Tip slipped, or pen lost</source>
        <translation>测头滑动，或光笔丢失</translation>
    </message>
    <message>
        <source>All captured</source>
        <translation>采集完毕</translation>
    </message>
    <message>
        <source>Done</source>
        <translation>完成</translation>
    </message>
    <message>
        <source>Failed</source>
        <translation>失败</translation>
    </message>
    <message>
        <source>Test the sounds</source>
        <translation>测试声音</translation>
    </message>
    <message>
        <source>Plays what you will hear during the swing, one after the other.</source>
        <translation>依次播放摆动时会听到的声音。</translation>
    </message>
</context>
<context>
    <name>SourcePanel</name>
    <message>
        <source>Cameras found: {0}</source>
        <translation>找到的相机：{0}</translation>
    </message>
    <message>
        <source>No camera was found. Check its power and its cable, or enter its serial number or its address.</source>
        <translation>没有找到相机。请检查电源和线缆，或输入其序列号或地址。</translation>
    </message>
    <message>
        <source>GenTL producer of the camera</source>
        <translation>相机的 GenTL 生产者文件</translation>
    </message>
    <message>
        <source>GenTL producers ({0})</source>
        <translation>GenTL 生产者文件 ({0})</translation>
    </message>
    <message>
        <source>Folder of the recorded images</source>
        <translation>录制图像的文件夹</translation>
    </message>
    <message>
        <source>Video of the pen</source>
        <translation>光笔视频</translation>
    </message>
    <message>
        <source>Videos and images ({0})</source>
        <translation>视频和图像 ({0})</translation>
    </message>
    <message>
        <source>The search is on.</source>
        <translation>正在搜索。</translation>
    </message>
    <message>
        <source>Cameras are being looked for.</source>
        <translation>正在搜索相机。</translation>
    </message>
    <message>
        <source> and </source>
        <translation> 和 </translation>
    </message>
    <message>
        <source>Beside the images: {0}</source>
        <translation>图像旁边有：{0}</translation>
    </message>
    <message>
        <source>Use both</source>
        <translation>两者都用</translation>
    </message>
    <message>
        <source>Use it</source>
        <translation>使用</translation>
    </message>
    <message>
        <source>Source of the images</source>
        <translation>图像来源</translation>
    </message>
    <message>
        <source>Source of the second camera</source>
        <translation>第二台相机的图像来源</translation>
    </message>
    <message>
        <source>{0} - not installed</source>
        <translation>{0} - 未安装</translation>
    </message>
    <message>
        <source>Folder, record or video</source>
        <translation>文件夹、记录或视频</translation>
    </message>
    <message>
        <source>Open...</source>
        <translation>打开...</translation>
    </message>
    <message>
        <source>Folder or record...</source>
        <translation>文件夹或记录...</translation>
    </message>
    <message>
        <source>Video...</source>
        <translation>视频...</translation>
    </message>
    <message>
        <source>GenTL producer</source>
        <translation>GenTL 生产者文件</translation>
    </message>
    <message>
        <source>GenTL producers of the system</source>
        <translation>系统的 GenTL 生产者文件</translation>
    </message>
    <message>
        <source>Serial number or address</source>
        <translation>序列号或地址</translation>
    </message>
    <message>
        <source>Search</source>
        <translation>搜索</translation>
    </message>
    <message>
        <source>Use its files</source>
        <translation>使用其文件</translation>
    </message>
    <message>
        <source>Use the intrinsics and the LED file of the simulated pen.</source>
        <translation>使用模拟光笔的内参文件和 LED 文件。</translation>
    </message>
    <message>
        <source>Try again</source>
        <translation>重试</translation>
    </message>
</context>
<context>
    <name>SpinRecorder</name>
    <message>
        <source>Press the tip into the cone, and turn the pen about its stylus.</source>
        <translation>将测头压入锥孔，绕测杆转动光笔。</translation>
    </message>
    <message>
        <source>Turned by {0} degrees; U (k = 2) of the axis {1} degrees.</source>
        <translation>已转动 {0} 度；轴线的 U (k = 2) 为 {1} 度。</translation>
    </message>
</context>
<context>
    <name>StartPage</name>
    <message>
        <source>Start</source>
        <translation>开始</translation>
    </message>
    <message>
        <source>Say what is calibrated. All of it is remembered for the station.</source>
        <translation>填写标定对象，程序会为本工位记住。</translation>
    </message>
    <message>
        <source>Continue to the camera</source>
        <translation>下一步：相机</translation>
    </message>
    <message>
        <source>Tip {0} is retired. Choose another one, or bring it back in the library.</source>
        <translation>测头 {0} 已停用。请另选一个，或在测头库中恢复使用。</translation>
    </message>
    <message>
        <source>The last calibration cannot be shown.</source>
        <translation>无法显示上次标定。</translation>
    </message>
    <message>
        <source>A swing is under way.</source>
        <translation>正在摆动。</translation>
    </message>
</context>
<context>
    <name>StepButton</name>
    <message>
        <source>done</source>
        <translation>已完成</translation>
    </message>
    <message>
        <source>done, with doubts</source>
        <translation>已完成，需检查</translation>
    </message>
    <message>
        <source>now</source>
        <translation>进行中</translation>
    </message>
    <message>
        <source>to do</source>
        <translation>待完成</translation>
    </message>
    <message>
        <source>closed</source>
        <translation>未开放</translation>
    </message>
</context>
<context>
    <name>StepList</name>
    <message>
        <source>Steps</source>
        <translation>步骤</translation>
    </message>
</context>
<context>
    <name>StrayLightPanel</name>
    <message>
        <source>Stray light</source>
        <translation>杂散光</translation>
    </message>
    <message>
        <source>Cover the pen, then search for what still shines.</source>
        <translation>遮住光笔，再搜索仍然发亮的地方。</translation>
    </message>
    <message>
        <source>Search</source>
        <translation>搜索</translation>
    </message>
    <message>
        <source>Clear the mask</source>
        <translation>清除屏蔽</translation>
    </message>
    <message>
        <source>Draw the mask on the image</source>
        <translation>在图像上绘制屏蔽区</translation>
    </message>
    <message>
        <source>Click a spot to mask it, draw a circle with the button held down, or click into a circle to take it away.</source>
        <translation>点击光斑将其屏蔽，按住鼠标键画圆，或点击圆内将其删除。</translation>
    </message>
    <message>
        <source>Uncover the LEDs</source>
        <translation>取消遮挡</translation>
    </message>
    <message>
        <source>Cover the LEDs</source>
        <translation>遮住 LED</translation>
    </message>
    <message>
        <source>The simulated operator does it.</source>
        <translation>由模拟操作员完成。</translation>
    </message>
    <message>
        <source>Mask the spots: {0}</source>
        <translation>屏蔽光点：{0}</translation>
    </message>
    <message>
        <source>Mask the spots</source>
        <translation>屏蔽光点</translation>
    </message>
    <message>
        <source>No images come.</source>
        <translation>没有图像。</translation>
    </message>
    <message>
        <source>The search is on.</source>
        <translation>正在搜索。</translation>
    </message>
    <message>
        <source>Nothing was found to mask.</source>
        <translation>没有需要屏蔽的光点。</translation>
    </message>
    <message>
        <source>Nothing is masked.</source>
        <translation>没有屏蔽。</translation>
    </message>
    <message>
        <source>Masked places: {0}</source>
        <translation>已屏蔽：{0} 处</translation>
    </message>
    <message>
        <source>Searching: image {0} of {1}</source>
        <translation>正在搜索：图像 {0} / {1}</translation>
    </message>
    <message>
        <source>The pen is still seen. Cover all of its LEDs, then search again. Nothing is masked.</source>
        <translation>仍能看到光笔。请遮住全部 LED，再次搜索。没有屏蔽任何光点。</translation>
    </message>
    <message>
        <source>What shines moves, so it is no stray light. Cover the pen, then search again.</source>
        <translation>发亮处在移动，不是杂散光。请遮住光笔，再次搜索。</translation>
    </message>
    <message>
        <source>No stray light: nothing bright is left.</source>
        <translation>没有杂散光：没有其他发亮的地方。</translation>
    </message>
    <message>
        <source>Stray spots: {0}. Mask them, or take their cause away.</source>
        <translation>杂散光点：{0} 个。请屏蔽，或移走光源。</translation>
    </message>
    <message>
        <source>Bright spots: {0}. Is the pen covered? Without its LED file it cannot be told from stray light.</source>
        <translation>亮点：{0} 个。光笔遮住了吗？没有 LED 文件就无法区分光笔与杂散光。</translation>
    </message>
</context>
<context>
    <name>StreamDialog</name>
    <message>
        <source>Every computer in that network can follow the pen. Nobody has to sign in, and a firewall may ask for permission.</source>
        <translation>该网络中的每台计算机都能跟踪光笔，无需登录；防火墙可能会要求许可。</translation>
    </message>
    <message>
        <source>On at {0}. Programs that listen: {1}.</source>
        <translation>已开启：{0}。接收程序：{1}。</translation>
    </message>
    <message>
        <source>The pose alone is sent: no tip is in force.</source>
        <translation>只发送位姿：没有生效的测头。</translation>
    </message>
    <message>
        <source>Live stream</source>
        <translation>实时数据流</translation>
    </message>
    <message>
        <source>Other programs, such as 3D Slicer, can follow the pen and its tip live, by OpenIGTLink.</source>
        <translation>其他程序（例如 3D Slicer）可以通过 OpenIGTLink 实时跟踪光笔和测头。</translation>
    </message>
    <message>
        <source>Address</source>
        <translation>地址</translation>
    </message>
    <message>
        <source>{0} for programs of this computer alone, {1} for every network of it, or one of its own addresses.</source>
        <translation>{0} 仅限本机程序，{1} 对本机的所有网络开放，或填写本机的某个地址。</translation>
    </message>
    <message>
        <source>Port</source>
        <translation>端口</translation>
    </message>
    <message>
        <source>Stream pose and tip</source>
        <translation>发送位姿和测头位置</translation>
    </message>
    <message>
        <source>Close</source>
        <translation>关闭</translation>
    </message>
</context>
<context>
    <name>SupervisorFields</name>
    <message>
        <source>Supervisor</source>
        <translation>主管</translation>
    </message>
    <message>
        <source>Supervisor&apos;s password</source>
        <translation>主管密码</translation>
    </message>
</context>
<context>
    <name>SwingFace</name>
    <message>
        <source>No image yet.</source>
        <translation>还没有图像。</translation>
    </message>
    <message>
        <source>Progress</source>
        <translation>进度</translation>
    </message>
</context>
<context>
    <name>SwingPage</name>
    <message>
        <source>Swing</source>
        <translation>摆动</translation>
    </message>
    <message>
        <source>No image is kept yet.</source>
        <translation>还没有保留的图像。</translation>
    </message>
    <message>
        <source>Finish early</source>
        <translation>提前结束</translation>
    </message>
    <message>
        <source>Review</source>
        <translation>复核</translation>
    </message>
    <message>
        <source>Finish now</source>
        <translation>现在结束</translation>
    </message>
    <message>
        <source>Go on swinging</source>
        <translation>继续摆动</translation>
    </message>
    <message>
        <source>Something else was chosen meanwhile. This swing goes on with the files, names and limits that it began with.</source>
        <translation>期间更改了选择。本次摆动仍使用开始时的文件、名称和限值。</translation>
    </message>
    <message>
        <source>Start over with the new ones</source>
        <translation>用新的重新开始</translation>
    </message>
    <message>
        <source>Go on with this swing</source>
        <translation>继续本次摆动</translation>
    </message>
    <message>
        <source>The swing is not finished. The images kept so far ({0}) are safe; it is offered again at the next start.</source>
        <translation>本次摆动尚未完成。已保留的图像（{0} 幅）是安全的；下次启动时可以继续。</translation>
    </message>
    <message>
        <source>Start over</source>
        <translation>重新开始</translation>
    </message>
    <message>
        <source>Set this swing aside and begin anew. Its images are kept.</source>
        <translation>搁置本次摆动并重新开始。图像会保留。</translation>
    </message>
    <message>
        <source>The tip is being computed.</source>
        <translation>正在计算测头。</translation>
    </message>
    <message>
        <source>The swing goes on.</source>
        <translation>摆动继续进行。</translation>
    </message>
    <message>
        <source>There is no tip to review: choose other images.</source>
        <translation>没有可复核的测头：请选择其他图像。</translation>
    </message>
    <message>
        <source>There is no tip to review: capture more, or start over.</source>
        <translation>没有可复核的测头：请继续采集，或重新开始。</translation>
    </message>
    <message>
        <source>The tip is not computed yet.</source>
        <translation>测头尚未计算。</translation>
    </message>
    <message>
        <source>Open the camera</source>
        <translation>打开相机</translation>
    </message>
    <message>
        <source>Try again</source>
        <translation>重试</translation>
    </message>
    <message>
        <source>Go on (Space)</source>
        <translation>继续（空格）</translation>
    </message>
    <message>
        <source>Pause (Space)</source>
        <translation>暂停（空格）</translation>
    </message>
    <message>
        <source>Stop computing</source>
        <translation>停止计算</translation>
    </message>
    <message>
        <source>Compute again</source>
        <translation>重新计算</translation>
    </message>
    <message>
        <source>Capture more</source>
        <translation>继续采集</translation>
    </message>
    <message>
        <source>All recorded images are read.</source>
        <translation>录制的图像已全部读取。</translation>
    </message>
    <message>
        <source>Begin anew? The images of this swing ({0}) are set aside; they stay on the disk.</source>
        <translation>重新开始？本次摆动的图像（{0} 幅）将被搁置，但仍保留在磁盘上。</translation>
    </message>
    <message>
        <source>Begin anew</source>
        <translation>重新开始</translation>
    </message>
</context>
<context>
    <name>SwingPlots</name>
    <message>
        <source>limit {0}</source>
        <translation>限值 {0}</translation>
    </message>
    <message>
        <source>Misfit of each image / px</source>
        <translation>各图像的拟合误差 / px</translation>
    </message>
    <message>
        <source>Tip of each image / µm</source>
        <translation>各图像的测头位置 / µm</translation>
    </message>
    <message>
        <source>Tip estimate / µm</source>
        <translation>测头估计值 / µm</translation>
    </message>
    <message>
        <source>U (k = 2) of the tip / µm</source>
        <translation>测头的 U (k = 2) / µm</translation>
    </message>
    <message>
        <source>floor</source>
        <translation>下限</translation>
    </message>
</context>
<context>
    <name>SwingSight</name>
    <message>
        <source>The images are not of the size that this swing needs.</source>
        <translation>图像尺寸与本次摆动不符。</translation>
    </message>
    <message>
        <source>bright spots: {0}, {1} images/s</source>
        <translation>亮点：{0}，{1} 幅/秒</translation>
    </message>
    <message>
        <source>{0} of {1} LEDs, {2} images/s</source>
        <translation>{0} / {1} 个 LED，{2} 幅/秒</translation>
    </message>
</context>
<context>
    <name>SwingWords</name>
    <message>
        <source>No swing</source>
        <translation>没有摆动</translation>
    </message>
    <message>
        <source>recorded images</source>
        <translation>录制的图像</translation>
    </message>
    <message>
        <source>{0}; {1} dropped</source>
        <translation>{0}；已丢弃 {1} 幅</translation>
    </message>
    <message>
        <source>more are needed, as U (k = 2) has risen</source>
        <translation>U (k = 2) 变大，需要更多图像</translation>
    </message>
    <message>
        <source>more are needed to fill the postures</source>
        <translation>需要更多图像才能填满各姿态</translation>
    </message>
    <message>
        <source>The camera sends none; nothing is lost. Press Space to go on when they come.</source>
        <translation>相机没有发送图像；没有任何丢失。图像恢复后按空格键继续。</translation>
    </message>
    <message>
        <source>Not computed</source>
        <translation>尚未计算</translation>
    </message>
    <message>
        <source>The images are kept. Compute the tip again, or start over.</source>
        <translation>图像已保留。请重新计算测头，或重新开始。</translation>
    </message>
    <message>
        <source>Accepted</source>
        <translation>已接受</translation>
    </message>
    <message>
        <source>Put the pen down.</source>
        <translation>请放下光笔。</translation>
    </message>
    <message>
        <source>Go back to the step Swing at the screen to go on.</source>
        <translation>请在屏幕上回到“摆动”步骤以继续。</translation>
    </message>
    <message>
        <source>An image could not be recorded; the notice at the top says why. Mend it, then press Space.</source>
        <translation>有图像无法记录，原因见顶部提示。排除后按空格键。</translation>
    </message>
    <message>
        <source>The tip is being computed.</source>
        <translation>正在计算测头。</translation>
    </message>
    <message>
        <source>Let the simulated operator swing; or press Seat, and lean the pen by dragging the dial.</source>
        <translation>让模拟操作员摆动；或按“就位”，再拖动姿态盘使光笔倾斜。</translation>
    </message>
    <message>
        <source>Done</source>
        <translation>完成</translation>
    </message>
    <message>
        <source>Look at it</source>
        <translation>请查看</translation>
    </message>
    <message>
        <source>Repeat the swing</source>
        <translation>重做摆动</translation>
    </message>
    <message>
        <source>Capture more</source>
        <translation>继续采集</translation>
    </message>
    <message>
        <source>Go on to the review.</source>
        <translation>请转到复核。</translation>
    </message>
    <message>
        <source>Hold the pen upright and still for 3 s to see the review.</source>
        <translation>把光笔竖直握住不动 3 秒，即可查看结果。</translation>
    </message>
    <message>
        <source>No images</source>
        <translation>没有图像</translation>
    </message>
    <message>
        <source>The camera sends none. The swing goes on by itself as soon as they come; nothing is lost.</source>
        <translation>相机没有送来图像。图像一到，摆动自动继续；不会丢失任何数据。</translation>
    </message>
    <message>
        <source>NO IMAGES</source>
        <translation>没有图像</translation>
    </message>
    <message>
        <source>STOPPED</source>
        <translation>已停止</translation>
    </message>
    <message>
        <source>READING</source>
        <translation>读取中</translation>
    </message>
    <message>
        <source>NOT KEPT</source>
        <translation>未保留</translation>
    </message>
    <message>
        <source>{0} of {1} read</source>
        <translation>已读取 {0} / {1}</translation>
    </message>
    <message>
        <source>{0} kept, {1} to go</source>
        <translation>已保留 {0}，还需 {1}</translation>
    </message>
    <message>
        <source>Go on at the screen.</source>
        <translation>请在屏幕上继续。</translation>
    </message>
    <message>
        <source>Put the pen down. Go on at the screen.</source>
        <translation>请放下光笔，在屏幕上继续。</translation>
    </message>
    <message>
        <source>about {0} min left</source>
        <translation>约剩 {0} 分钟</translation>
    </message>
    <message>
        <source>about {0} s left</source>
        <translation>约剩 {0} 秒</translation>
    </message>
    <message>
        <source>Enter: see the review</source>
        <translation>Enter：查看复核</translation>
    </message>
    <message>
        <source>Space: go on</source>
        <translation>空格：继续</translation>
    </message>
    <message>
        <source>Space: pause</source>
        <translation>空格：暂停</translation>
    </message>
    <message>
        <source>TIP SLIPPED</source>
        <translation>测头滑动</translation>
    </message>
    <message>
        <source>No swing yet</source>
        <translation>尚无摆动</translation>
    </message>
    <message>
        <source>It begins as soon as the step Swing is shown at the screen.</source>
        <translation>屏幕上显示“摆动”步骤后即开始。</translation>
    </message>
    <message>
        <source>at most {0} images</source>
        <translation>最多 {0} 幅图像</translation>
    </message>
    <message>
        <source>The tip is used from now on.</source>
        <translation>从现在起使用该测头。</translation>
    </message>
    <message>
        <source>{0} of at least {1}</source>
        <translation>{0} / 至少 {1}</translation>
    </message>
</context>
<context>
    <name>TakingAlong</name>
    <message>
        <source>The tip is copied: x, y, z in mm.</source>
        <translation>已复制测头坐标：x、y、z，单位 mm。</translation>
    </message>
    <message>
        <source>Folder to save in</source>
        <translation>保存到的文件夹</translation>
    </message>
    <message>
        <source>Saved in {0}</source>
        <translation>已保存到 {0}</translation>
    </message>
</context>
<context>
    <name>TaskPanel</name>
    <message>
        <source>Recorded images...</source>
        <translation>录制的图像...</translation>
    </message>
    <message>
        <source>Do this task with images that were recorded before.</source>
        <translation>用以前录制的图像完成该项。</translation>
    </message>
    <message>
        <source>Touch again</source>
        <translation>重新触测</translation>
    </message>
    <message>
        <source>Do this task again; what it found before is kept.</source>
        <translation>重做该项；先前得到的结果保留。</translation>
    </message>
</context>
<context>
    <name>TipPicture</name>
    <message>
        <source>Picture of the tip</source>
        <translation>测头图片</translation>
    </message>
    <message>
        <source>No picture</source>
        <translation>无图片</translation>
    </message>
</context>
<context>
    <name>TouchHand</name>
    <message>
        <source>Simulated pen</source>
        <translation>模拟光笔</translation>
    </message>
    <message>
        <source>Let the simulated operator touch</source>
        <translation>让模拟操作员触测</translation>
    </message>
    <message>
        <source>It touches whatever is asked for by itself.</source>
        <translation>它自行触测所要求的各处。</translation>
    </message>
    <message>
        <source>Its ring has a radius of {0} mm, its bar a length of {1} mm.</source>
        <translation>其圆环半径为 {0} mm，标准棒长度为 {1} mm。</translation>
    </message>
    <message>
        <source>Lift</source>
        <translation>抬起</translation>
    </message>
    <message>
        <source>Take the tip away for a moment.</source>
        <translation>暂时移开测头。</translation>
    </message>
</context>
<context>
    <name>TrendPanel</name>
    <message>
        <source>{0} / mm, with U (k = 2)</source>
        <translation>{0} / mm，带 U (k = 2)</translation>
    </message>
    <message>
        <source>calibration no.</source>
        <translation>标定序号</translation>
    </message>
    <message>
        <source>Largest U (k = 2) / mm</source>
        <translation>最大 U (k = 2) / mm</translation>
    </message>
    <message>
        <source>Choose an entry with a tip: its trend is shown here.</source>
        <translation>选择一个带测头数据的条目，此处显示其趋势。</translation>
    </message>
    <message>
        <source>Pen {0}, tip {1}: one calibration, {2}. Dashed: the limit of U.</source>
        <translation>光笔 {0}，测头 {1}：一次标定，{2}。虚线：U 的限值。</translation>
    </message>
    <message>
        <source>Pen {0}, tip {1}: {2} calibrations, {3} to {4}. Dashed: three standard deviations from their mean, and the limit of U.</source>
        <translation>光笔 {0}，测头 {1}：{2} 次标定，{3} 至 {4}。虚线：平均值上下三倍标准差，以及 U 的限值。</translation>
    </message>
</context>
<context>
    <name>UncertaintyPanel</name>
    <message>
        <source>Parts of U (k = 2) / µm</source>
        <translation>U (k = 2) 的组成 / µm</translation>
    </message>
    <message>
        <source>Postures: tilt / °</source>
        <translation>姿态：倾角 / °</translation>
    </message>
    <message>
        <source>to the right</source>
        <translation>向右</translation>
    </message>
    <message>
        <source>away from the camera</source>
        <translation>远离相机</translation>
    </message>
    <message>
        <source>* assumed: the file tells no uncertainty.</source>
        <translation>* 假定值：文件未给出不确定度。</translation>
    </message>
    <message>
        <source>all</source>
        <translation>合成</translation>
    </message>
    <message>
        <source>Weakest direction ({0}): U = {1} µm.</source>
        <translation>最弱方向 ({0})：U = {1} µm。</translation>
    </message>
    <message>
        <source>Images hang together: their noise counts {0} times (variance).</source>
        <translation>各图像相关：噪声方差按 {0} 倍计。</translation>
    </message>
</context>
<context>
    <name>UndoButtons</name>
    <message>
        <source>Nothing to undo.</source>
        <translation>没有可撤销的操作。</translation>
    </message>
    <message>
        <source>Nothing to redo.</source>
        <translation>没有可取消的撤销。</translation>
    </message>
    <message>
        <source>Undo</source>
        <translation>撤销</translation>
    </message>
    <message>
        <source>Redo</source>
        <translation>取消撤销</translation>
    </message>
</context>
<context>
    <name>VerificationRow</name>
    <message>
        <source>Close it as abandoned? All that is kept of it stays.</source>
        <translation>作为放弃结束？已保存的内容均保留。</translation>
    </message>
    <message>
        <source>Continue</source>
        <translation>继续</translation>
    </message>
    <message>
        <source>Continue the verification of {0}</source>
        <translation>继续 {0} 的验证</translation>
    </message>
    <message>
        <source>Close it</source>
        <translation>结束</translation>
    </message>
    <message>
        <source>Close the verification of {0}</source>
        <translation>结束 {0} 的验证</translation>
    </message>
    <message>
        <source>Keep</source>
        <translation>保留</translation>
    </message>
    <message>
        <source>Keep the verification of {0}</source>
        <translation>保留 {0} 的验证</translation>
    </message>
    <message>
        <source>Damaged: {0}</source>
        <translation>已损坏：{0}</translation>
    </message>
    <message>
        <source>d MMM yyyy, hh:mm</source>
        <translation>yyyy年M月d日 hh:mm</translation>
    </message>
    <message>
        <source>verification, {0} of {1} tasks</source>
        <translation>验证，已完成 {0} / {1} 项任务</translation>
    </message>
</context>
<context>
    <name>VerifyPage</name>
    <message>
        <source>Verify</source>
        <translation>验证</translation>
    </message>
    <message>
        <source>Prove the tip in force by touching what is known.</source>
        <translation>触测已知的标准件，验证当前有效的测头。</translation>
    </message>
    <message>
        <source>d MMMM yyyy, hh:mm</source>
        <translation>yyyy年M月d日 hh:mm</translation>
    </message>
    <message>
        <source>Tip {0} of pen {1}, in force since {2}</source>
        <translation>光笔 {1} 的测头 {0}，自 {2} 起有效</translation>
    </message>
    <message>
        <source>accepted by {0}</source>
        <translation>由 {0} 接受</translation>
    </message>
    <message>
        <source>kept as {0}</source>
        <translation>保存为 {0}</translation>
    </message>
    <message>
        <source>Back to Start</source>
        <translation>回到开始</translation>
    </message>
    <message>
        <source>Nothing is touched yet.</source>
        <translation>尚未触测任何点。</translation>
    </message>
    <message>
        <source>Finish early</source>
        <translation>提前结束</translation>
    </message>
    <message>
        <source>The verification is not finished. The touches of the task at hand are lost; what is found is kept.</source>
        <translation>验证尚未完成。当前项的触测将丢失；已得到的结果保留。</translation>
    </message>
    <message>
        <source>Begin the verification anew? What was found is kept.</source>
        <translation>重新开始验证？已得到的结果保留。</translation>
    </message>
    <message>
        <source>Begin anew</source>
        <translation>重新开始</translation>
    </message>
    <message>
        <source>Go on</source>
        <translation>继续</translation>
    </message>
    <message>
        <source>Something was found against the tip. Why is it used nevertheless? The reason is kept with the verification.</source>
        <translation>发现了对测头不利的情况。为何仍要使用它？理由随验证一起保存。</translation>
    </message>
    <message>
        <source>Reason</source>
        <translation>理由</translation>
    </message>
    <message>
        <source>Accept with this reason</source>
        <translation>按此理由接受</translation>
    </message>
    <message>
        <source>Do not accept</source>
        <translation>不接受</translation>
    </message>
    <message>
        <source>Accept...</source>
        <translation>接受...</translation>
    </message>
    <message>
        <source>Use the tip with a reason</source>
        <translation>说明理由后使用测头</translation>
    </message>
    <message>
        <source>Start over</source>
        <translation>重新开始</translation>
    </message>
    <message>
        <source>Forget all touches, and verify the tip in force from the first.</source>
        <translation>忘记所有触测，从头验证当前有效的测头。</translation>
    </message>
    <message>
        <source>No image yet.</source>
        <translation>尚无图像。</translation>
    </message>
    <message>
        <source>Progress</source>
        <translation>进度</translation>
    </message>
    <message>
        <source>Tasks</source>
        <translation>各项</translation>
    </message>
    <message>
        <source>Pen</source>
        <translation>光笔</translation>
    </message>
    <message>
        <source>Live image</source>
        <translation>实时图像</translation>
    </message>
    <message>
        <source>Go on (Space)</source>
        <translation>继续（空格键）</translation>
    </message>
    <message>
        <source>Pause (Space)</source>
        <translation>暂停（空格键）</translation>
    </message>
</context>
<context>
    <name>VerifyWords</name>
    <message>
        <source>Space: go on</source>
        <translation>空格：继续</translation>
    </message>
    <message>
        <source>Space: pause</source>
        <translation>空格：暂停</translation>
    </message>
    <message>
        <source>{0} of {1} touches</source>
        <translation>触测 {0} / {1} 次</translation>
    </message>
    <message>
        <source>{0} of {1}°</source>
        <translation>{0}° / {1}°</translation>
    </message>
    <message>
        <source>{0} of 2 ends</source>
        <translation>{0} / 2 端</translation>
    </message>
    <message>
        <source>{0}, run {1} of {2}</source>
        <translation>{0}，第 {1} / {2} 轮</translation>
    </message>
    <message>
        <source>Fixed point</source>
        <translation>固定点</translation>
    </message>
    <message>
        <source>Ring</source>
        <translation>圆环</translation>
    </message>
    <message>
        <source>Length</source>
        <translation>长度</translation>
    </message>
    <message>
        <source>Postures</source>
        <translation>姿态</translation>
    </message>
    <message>
        <source>Witness</source>
        <translation>监视点</translation>
    </message>
    <message>
        <source>now</source>
        <translation>正在进行</translation>
    </message>
    <message>
        <source>to do</source>
        <translation>待做</translation>
    </message>
    <message>
        <source>{0}: {1}</source>
        <translation>{0}：{1}</translation>
    </message>
    <message>
        <source>The touches of recorded images are measured.</source>
        <translation>正在测量录制图像中的触测。</translation>
    </message>
    <message>
        <source>Reading images</source>
        <translation>正在读取图像</translation>
    </message>
    <message>
        <source>Nothing to verify</source>
        <translation>无法验证</translation>
    </message>
    <message>
        <source>Wait</source>
        <translation>请稍候</translation>
    </message>
    <message>
        <source>The tip in force is being read.</source>
        <translation>正在读取当前有效的测头。</translation>
    </message>
    <message>
        <source>Tip proven</source>
        <translation>测头已通过验证</translation>
    </message>
    <message>
        <source>Look at it</source>
        <translation>需查看</translation>
    </message>
    <message>
        <source>Not proven</source>
        <translation>测头未通过验证</translation>
    </message>
    <message>
        <source>The camera sends none. It goes on by itself as soon as they come.</source>
        <translation>相机没有送来图像。图像一到便自动继续。</translation>
    </message>
    <message>
        <source>No images</source>
        <translation>没有图像</translation>
    </message>
    <message>
        <source>Paused</source>
        <translation>已暂停</translation>
    </message>
    <message>
        <source>Press Space to go on.</source>
        <translation>按空格键继续。</translation>
    </message>
    <message>
        <source>Hold still</source>
        <translation>握住不动</translation>
    </message>
    <message>
        <source>Touched before</source>
        <translation>已触测过</translation>
    </message>
    <message>
        <source>Lean another way</source>
        <translation>换个方向倾斜</translation>
    </message>
    <message>
        <source>Touch the cone</source>
        <translation>触测锥孔</translation>
    </message>
    <message>
        <source>Next point</source>
        <translation>下一点</translation>
    </message>
    <message>
        <source>Touch the ring</source>
        <translation>触测圆环</translation>
    </message>
    <message>
        <source>Lift, touch again</source>
        <translation>抬起，再接触</translation>
    </message>
    <message>
        <source>Another posture</source>
        <translation>换一个姿态</translation>
    </message>
    <message>
        <source>Touch the cone upright</source>
        <translation>光笔竖直，触测锥孔</translation>
    </message>
    <message>
        <source>The other end</source>
        <translation>另一端</translation>
    </message>
    <message>
        <source>Touch one end</source>
        <translation>触测一端</translation>
    </message>
    <message>
        <source>Not taken</source>
        <translation>未取得</translation>
    </message>
    <message>
        <source>Not counted</source>
        <translation>不计入</translation>
    </message>
    <message>
        <source>READING</source>
        <translation>读取中</translation>
    </message>
    <message>
        <source>NOT POSSIBLE</source>
        <translation>无法进行</translation>
    </message>
    <message>
        <source>NO IMAGES</source>
        <translation>没有图像</translation>
    </message>
    <message>
        <source>PAUSED</source>
        <translation>已暂停</translation>
    </message>
    <message>
        <source>TAKEN</source>
        <translation>已取得</translation>
    </message>
    <message>
        <source>TOUCHED BEFORE</source>
        <translation>已接触过</translation>
    </message>
    <message>
        <source>HELD</source>
        <translation>保持中</translation>
    </message>
    <message>
        <source>NOT TAKEN</source>
        <translation>未取得</translation>
    </message>
    <message>
        <source>WAITING</source>
        <translation>等待中</translation>
    </message>
    <message>
        <source>PEN SEEN</source>
        <translation>看到光笔</translation>
    </message>
</context>
<context>
    <name>Wizard</name>
    <message>
        <source>Other windows of the program use the data folder {0}. All of them put their tips in force there.</source>
        <translation>其他程序窗口也在使用数据文件夹 {0}。它们接受的测头都在那里生效。</translation>
    </message>
</context>
<context>
    <name>_DraftModel</name>
    <message>
        <source>How far the LED is seen from where this table puts it, in px of the live images.</source>
        <translation>LED 的实际位置与表格位置之差，以实时图像的 px 计。</translation>
    </message>
    <message>
        <source>LED</source>
        <translation>LED</translation>
    </message>
    <message>
        <source>off, px</source>
        <translation>Δ, px</translation>
    </message>
</context>
<context>
    <name>_UnitsRow</name>
    <message>
        <source>{0} does not say the units of its coordinates. Choose them:</source>
        <translation>{0} 未注明坐标单位。请选择：</translation>
    </message>
    <message>
        <source>Units of the file</source>
        <translation>文件的单位</translation>
    </message>
</context>
<context>
    <name>core</name>
    <message>
        <source>({x:g}, {y:g}) px lies outside every image. Correct or remove the line.</source>
        <translation>({x:g}, {y:g}) px 在任何图像之外。请改正或删除该行。</translation>
    </message>
    <message>
        <source>, </source>
        <translation>、</translation>
    </message>
    <message>
        <source>1 column</source>
        <translation>1 列</translation>
    </message>
    <message>
        <source>1 distortion coefficient</source>
        <translation>1 个畸变系数</translation>
    </message>
    <message>
        <source>1 number</source>
        <translation>1 个数</translation>
    </message>
    <message>
        <source>5 coefficients, as 8 do not lessen the error in views left out: {held_out:.4f} px with 5, {held_out_more:.4f} px with 8.</source>
        <translation>采用 5 个畸变系数：8 个系数并未减小留出视图的误差（5 个系数 {held_out:.4f} px，8 个系数 {held_out_more:.4f} px）。</translation>
    </message>
    <message>
        <source>5 coefficients, as the views do not tell 8 apart. Error in views left out: {held_out:.4f} px.</source>
        <translation>采用 5 个畸变系数：这些视图无法区分 8 个系数。留出视图的误差：{held_out:.4f} px。</translation>
    </message>
    <message>
        <source>8 coefficients, as they lessen the error in views left out from {held_out:.4f} to {held_out_more:.4f} px.</source>
        <translation>采用 8 个畸变系数：留出视图的误差由 {held_out:.4f} px 减小到 {held_out_more:.4f} px。</translation>
    </message>
    <message>
        <source>A camera file is written as YAML, but {name} does not end in .yaml. Choose such a name.</source>
        <translation>内参文件以 YAML 保存，但 {name} 不以 .yaml 结尾。请选择这样的名称。</translation>
    </message>
    <message>
        <source>A control chart is written as .csv or .svg, but {name} ends in neither. Choose such a name.</source>
        <translation>控制图写为 .csv 或 .svg，而 {name} 不以二者结尾。请选择这样的文件名。</translation>
    </message>
    <message>
        <source>A name, the images of the camera or a file is missing. Choose what the steps say, and go on with the verification then.</source>
        <translation>缺少名称、相机图像或文件。请按各步骤的提示选择，然后继续验证。</translation>
    </message>
    <message>
        <source>A pen is written as .csv or .json, but {name} ends in neither. Choose such a name.</source>
        <translation>光笔以 .csv 或 .json 保存，但 {name} 的结尾两者都不是。请选择这样的名称。</translation>
    </message>
    <message>
        <source>A pen needs {least} to {most} LEDs; the file has {n_leds}. Check that it is the complete file of a pen.</source>
        <translation>光笔需要 {least} 至 {most} 个 LED；文件有 {n_leds} 个。请检查是否为一支光笔的完整文件。</translation>
    </message>
    <message>
        <source>All images of one camera had been held up on their way, so that the last pairs are of moments {moved:.0f} ms apart. From now on they are paired rightly. Images that do not fit are left out of the result: look at them in Review, or begin the swing again.</source>
        <translation>一台相机的所有图像都在传输途中被延误，因此最近的图像对实际相差 {moved:.0f} ms。从现在起配对正确。不相符的图像不会计入结果：请在“复核”中查看，或重新开始摆动。</translation>
    </message>
    <message>
        <source>All of them were taken, so the tip lies between both.</source>
        <translation>全部位姿均已采用，因此所得测头位于两者之间。</translation>
    </message>
    <message>
        <source>All recorded images are read, then the tip is computed.</source>
        <translation>先读取全部录制的图像，再计算测头。</translation>
    </message>
    <message>
        <source>All touches of {run} lie within {extent:.3f} mm: one end was touched again and the other not at all. Touch both ends.</source>
        <translation>{run} 的全部触测点都在 {extent:.3f} mm 之内：同一端被重复触测，另一端没有触测。请触测两端。</translation>
    </message>
    <message>
        <source>All views are from one distance. Hold the board nearer, too.</source>
        <translation>所有视图的距离都相同。请也把标定板拿近一些拍摄。</translation>
    </message>
    <message>
        <source>An archive on a server needs the package psycopg, which is not installed. Install it with: pip install &quot;lightpen[postgres]&quot;.</source>
        <translation>服务器上的档案库需要软件包 psycopg，但尚未安装。请用以下命令安装：pip install &quot;lightpen[postgres]&quot;。</translation>
    </message>
    <message>
        <source>Another program is writing to the swing in {folder}. Go on with it there, or close that program and try again.</source>
        <translation>另一个程序正在写入 {folder} 中的摆动。请在那里继续，或关闭该程序后重试。</translation>
    </message>
    <message>
        <source>Another program uses the camera {place}. Close that program, or wait a few seconds if it has just ended.</source>
        <translation>另一个程序正在使用相机 {place}。请关闭该程序；如果它刚刚结束，请等待几秒钟。</translation>
    </message>
    <message>
        <source>Another program uses the simulated camera {serial}. Close that program, or wait a few seconds.</source>
        <translation>另一个程序正在使用模拟相机 {serial}。请关闭该程序，或稍等几秒。</translation>
    </message>
    <message>
        <source>Another verification is under way. Finish it or start over, then go on with the interrupted one.</source>
        <translation>另一次验证正在进行。请先完成或重新开始，再继续中断的验证。</translation>
    </message>
    <message>
        <source>Another window has the verification of {file}. Go on with it there, or close that window and try again.</source>
        <translation>另一窗口正在进行 {file} 的验证。请在那里继续，或关闭该窗口后重试。</translation>
    </message>
    <message>
        <source>Aravis is not installed. It drives GigE Vision and USB3 Vision cameras on Linux: apt-get install libaravis-0.8-0</source>
        <translation>未安装 Aravis。它在 Linux 上驱动 GigE Vision 和 USB3 Vision 相机：apt-get install libaravis-0.8-0</translation>
    </message>
    <message>
        <source>Basler (pylon)</source>
        <translation>Basler (pylon)</translation>
    </message>
    <message>
        <source>Both cameras see the board in {n_pairs} views; at least {least} are needed. Hold the board where both cameras see it whole.</source>
        <translation>两台相机同时看到标定板的视图有 {n_pairs} 组，至少需要 {least} 组。请把标定板放在两台相机都能看到整块板的位置。</translation>
    </message>
    <message>
        <source>Calibrate each of both from a file of its own.</source>
        <translation>请将两组分别存为文件，各自标定。</translation>
    </message>
    <message>
        <source>Camera {camera} does not see the pen as the others do: at {n_apart} of {n_pairs} moments it is turned otherwise. Check that the images belong to the same swing and are paired rightly, that one signal triggers all cameras, and that none of them moved.</source>
        <translation>相机 {camera} 看到的光笔姿态与其他相机不一致：{n_pairs} 个时刻中有 {n_apart} 个的转角不同。请检查各图像是否属于同一次摆动且配对正确、所有相机是否由同一信号触发，以及是否有相机移动过。</translation>
    </message>
    <message>
        <source>Camera {camera} has no image at {n_absent} of {n_moments} moments, such as that of {example}. What the other cameras saw there is used.</source>
        <translation>相机 {camera} 在 {n_moments} 个时刻中的 {n_absent} 个没有图像，例如 {example} 所在的时刻。这些时刻采用其他相机的图像。</translation>
    </message>
    <message>
        <source>Camera {camera} is out of step with the first camera by some {lag:.2f} of the time between two images. That moves the tip, and other warnings may come of it. Trigger all cameras by one signal, or hold the pen still for each image.</source>
        <translation>相机 {camera} 与第一台相机不同步，约差两幅图像间隔的 {lag:.2f}。这会使测头位置偏移，也可能引起其他警告。请用同一信号触发所有相机，或在每次拍摄时握稳光笔。</translation>
    </message>
    <message>
        <source>Camera {camera}: {trouble}</source>
        <translation>相机 {camera}：{trouble}</translation>
    </message>
    <message>
        <source>Capture more images.</source>
        <translation>请采集更多图像。</translation>
    </message>
    <message>
        <source>Columns {first} and {second} of {name} both hold {column}. Remove one of them.</source>
        <translation>{name} 的第 {first} 列和第 {second} 列都是 {column}。请删除其中一列。</translation>
    </message>
    <message>
        <source>Complete the line; if it is the last one, the file is cut short.</source>
        <translation>请补全该行；如果是最后一行，则文件不完整。</translation>
    </message>
    <message>
        <source>Cone and camera moved by {distance:.3f} mm against each other during the swing. It is taken out as far as the images tell, but touches would not be right either. Clamp both, and let the camera warm up.</source>
        <translation>摆动过程中，锥孔与相机之间相对移动了 {distance:.3f} mm。图像能够判明的部分已被扣除，但此时接触测量同样不准确。请固定锥孔和相机，并让相机充分预热。</translation>
    </message>
    <message>
        <source>Connection timed out</source>
        <translation>连接超时</translation>
    </message>
    <message>
        <source>Dask is not installed here, which a cluster needs. Install the extra named cluster, or compute on this machine.</source>
        <translation>此处未安装集群所需的 Dask。请安装名为 cluster 的附加组件，或在本机计算。</translation>
    </message>
    <message>
        <source>Desktop entries are of Linux. On Windows the installer makes the entry of the start menu.</source>
        <translation>桌面条目仅适用于 Linux。在 Windows 上，开始菜单项由安装程序创建。</translation>
    </message>
    <message>
        <source>Diameter of the discs: {flaw}</source>
        <translation>发光面直径：{flaw}</translation>
    </message>
    <message>
        <source>Enter the name of the supervisor.</source>
        <translation>请输入主管的姓名。</translation>
    </message>
    <message>
        <source>Entries {first} to {last} of the chain {chain} are missing.</source>
        <translation>链 {chain} 的第 {first} 至第 {last} 个条目缺失。</translation>
    </message>
    <message>
        <source>Entry {number} of leds in {name} is LED {led:g}. List the LEDs from 1 in ascending order, each once.</source>
        <translation>{name} 中 leds 的第 {number} 项是 LED {led:g}。请从 1 开始按升序列出 LED，每个一次。</translation>
    </message>
    <message>
        <source>Entry {number} of the archive {archive} is damaged. Restore the archive from a copy.</source>
        <translation>档案库 {archive} 的第 {number} 个条目已损坏。请从备份恢复档案库。</translation>
    </message>
    <message>
        <source>Entry {number} of the chain {chain} does not follow the one before it: one of the two was replaced.</source>
        <translation>链 {chain} 的第 {number} 个条目与前一条不衔接：两者之一被替换过。</translation>
    </message>
    <message>
        <source>Entry {number} of the chain {chain} is missing.</source>
        <translation>链 {chain} 的第 {number} 个条目缺失。</translation>
    </message>
    <message>
        <source>Entry {number} of the chain {chain} was changed.</source>
        <translation>链 {chain} 的第 {number} 个条目被改动过。</translation>
    </message>
    <message>
        <source>Entry {number} of the chain {chain} was there when the archive was closed, and is not any more: entries were removed, or the archive was replaced.</source>
        <translation>链 {chain} 的第 {number} 条在档案关闭时存在，现已不存在：有条目被删除，或档案被替换。</translation>
    </message>
    <message>
        <source>Entry {number} put no tip in force. Choose one that did.</source>
        <translation>条目 {number} 未使任何测头数据生效。请选择使测头数据生效的条目。</translation>
    </message>
    <message>
        <source>File name too long</source>
        <translation>文件名过长</translation>
    </message>
    <message>
        <source>Frame {number} of the video</source>
        <translation>视频第 {number} 帧</translation>
    </message>
    <message>
        <source>GenICam with a vendor&apos;s GenTL producer</source>
        <translation>GenICam，使用厂商的 GenTL 生产者</translation>
    </message>
    <message>
        <source>GigE and USB3 Vision (Aravis)</source>
        <translation>GigE 和 USB3 Vision (Aravis)</translation>
    </message>
    <message>
        <source>Harvesters is not installed. With the GenTL producer of its vendor it drives any GenICam camera: {python} -m pip install harvesters genicam</source>
        <translation>未安装 Harvesters。它通过厂商的 GenTL 生产者驱动任何 GenICam 相机：{python} -m pip install harvesters genicam</translation>
    </message>
    <message>
        <source>Has the camera moved? Touch the cone {needed} times with the pen upright, and lift the tip in between: {n_touches} of {needed}. Visit {visit} of {n_visits}.</source>
        <translation>相机是否移动？请使光笔竖直，触测锥孔 {needed} 次，每次之间抬起测头：{n_touches} / {needed}。第 {visit} / {n_visits} 次监视。</translation>
    </message>
    <message>
        <source>Hold it so that the camera sees its LEDs.</source>
        <translation>握住光笔，使相机能看到 LED。</translation>
    </message>
    <message>
        <source>If numbers have decimal commas, separate the columns by semicolons.</source>
        <translation>如果数字使用小数逗号，请用分号分隔各列。</translation>
    </message>
    <message>
        <source>Image {seq} of the camera {serial} arrived incomplete and was left out. Check the cable and the network.</source>
        <translation>相机 {serial} 的图像 {seq} 到达时不完整，已舍弃。请检查线缆和网络。</translation>
    </message>
    <message>
        <source>Image {seq} of the simulated camera {serial} arrived incomplete. Check the cable and the network.</source>
        <translation>模拟相机 {serial} 的图像 {seq} 不完整。请检查线缆和网络。</translation>
    </message>
    <message>
        <source>Images dropped: {n_dropped}. Press the tip into the cone again.</source>
        <translation>已丢弃 {n_dropped} 幅图像。请把测头重新压入锥孔。</translation>
    </message>
    <message>
        <source>Images kept: {n_kept} of at least {needed}.</source>
        <translation>已保留 {n_kept} 幅图像，至少需要 {needed} 幅。</translation>
    </message>
    <message>
        <source>Images of the upright pen still needed: {n_images}.</source>
        <translation>还需 {n_images} 幅光笔竖直的图像。</translation>
    </message>
    <message>
        <source>In {n_views} of {n_pairs} views the two cameras do not see the board at one place; they differ by up to {rms:.2f} px. It moved between the two exposures, or a camera did. Hold it still, or trigger both cameras by one signal.</source>
        <translation>{n_pairs} 组视图中有 {n_views} 组，两台相机看到的标定板位置不一致，最大相差 {rms:.2f} px。两次曝光之间标定板或某台相机移动了。请保持静止，或用同一信号触发两台相机。</translation>
    </message>
    <message>
        <source>Input/output error</source>
        <translation>输入/输出错误</translation>
    </message>
    <message>
        <source>It agrees with them if it holds rig_from_cam; cam_from_rig is needed. Of each camera transpose the rotation R, and put -R^T t in place of the translation t.</source>
        <translation>若该文件给出的是 rig_from_cam，则与图像一致；而此处需要 cam_from_rig。请将每台相机的旋转 R 转置，并用 -R^T t 代替平移 t。</translation>
    </message>
    <message>
        <source>It agrees with them if it holds the places of the cameras in the rig instead of the translations of cam_from_rig. Put -R c in place of c.</source>
        <translation>若该文件给出的是相机在相机组中的位置，而不是 cam_from_rig 的平移，则与图像一致。请用 -R c 代替 c。</translation>
    </message>
    <message>
        <source>It agrees with them if its lengths are in {unit}. Millimetres are needed.</source>
        <translation>若该文件的长度单位为{unit}，则与图像一致。此处需要毫米。</translation>
    </message>
    <message>
        <source>It agrees with them if its rotations are transposed. Write each row by row, as it is multiplied to a column vector.</source>
        <translation>若将该文件中的旋转转置，则与图像一致。请按左乘列向量的形式逐行写出旋转矩阵。</translation>
    </message>
    <message>
        <source>It agrees with them if the images of {one} and {other} are exchanged: give the images in the order of the rig file, {names}.</source>
        <translation>若将 {one} 与 {other} 的图像对调，则与图像一致：请按相机组文件中的顺序（{names}）给出图像。</translation>
    </message>
    <message>
        <source>It rests {distance:.2f} mm from where it was. Put it back into the cone; check that the cone is clamped.</source>
        <translation>测头偏离原位 {distance:.2f} mm。请放回锥孔，并检查锥孔是否夹紧。</translation>
    </message>
    <message>
        <source>Keep the tip pressed into the cone.</source>
        <translation>保持测头压紧在锥孔中。</translation>
    </message>
    <message>
        <source>LED centres</source>
        <translation>LED 中心</translation>
    </message>
    <message>
        <source>LED {led} has moved by {distance:.3f} mm against the others, as {swing} has it: it was bent or knocked, or came loose.</source>
        <translation>据 {swing}，LED {led} 相对其他 LED 移动了 {distance:.3f} mm：它被碰弯、碰撞或松动。</translation>
    </message>
    <message>
        <source>LED {led} has moved by {distance:.3f} mm between the swings {first} and {swing}: no LED file is right for both. Give swings of after it only.</source>
        <translation>在 {first} 与 {swing} 两次摆动之间，LED {led} 移动了 {distance:.3f} mm：没有一个 LED 文件对两者都正确。请只给出移动之后的摆动。</translation>
    </message>
    <message>
        <source>LED {led} is listed already on line {line}.</source>
        <translation>LED {led} 已在第 {line} 行列出。</translation>
    </message>
    <message>
        <source>LED {led} is {distance:.2f} mm off the line of LEDs 1 to 4.</source>
        <translation>LED {led} 偏离 LED 1 至 4 的直线 {distance:.2f} mm。</translation>
    </message>
    <message>
        <source>LED {led} is {distance:.2f} mm off the plane of LEDs 5 to 10.</source>
        <translation>LED {led} 偏离 LED 5 至 10 的平面 {distance:.2f} mm。</translation>
    </message>
    <message>
        <source>LED {led} is {distance:.6g} m from the origin, which no pen is. Check the numbers and their units.</source>
        <translation>LED {led} 距原点 {distance:.6g} m，光笔不会这么大。请检查数值及其单位。</translation>
    </message>
    <message>
        <source>LED {led} of frame {frame} stands already on line {line}. Keep the right one.</source>
        <translation>第 {frame} 帧的 LED {led} 已在第 {line} 行给出。请保留正确的一个。</translation>
    </message>
    <message>
        <source>LED {led} of {name}</source>
        <translation>{name} 的 LED {led}</translation>
    </message>
    <message>
        <source>LED {led} of {name} has no normal, but others have. Give the normals of all LEDs or of none.</source>
        <translation>{name} 的 LED {led} 没有法向量，而其他 LED 有。请给出全部法向量，或都不给。</translation>
    </message>
    <message>
        <source>LED {led} sits {distance:.2f} mm off its place in the LED file. Is this the LED file of this pen?</source>
        <translation>LED {led} 偏离 LED 文件中的位置 {distance:.2f} mm。这是该光笔的 LED 文件吗？</translation>
    </message>
    <message>
        <source>LED {led} sits {distance:.3f} mm off its place in the pen file. Check the file, or measure the pen again.</source>
        <translation>LED {led} 偏离 LED 文件中的位置 {distance:.3f} mm。请检查文件，或重新测量光笔。</translation>
    </message>
    <message>
        <source>LED {led} stands where LED {needed} is needed, and no line has LED {needed}. Number the LEDs from 1 without gaps.</source>
        <translation>应为 LED {needed} 的地方是 LED {led}，而且没有一行是 LED {needed}。请从 1 开始连续编号。</translation>
    </message>
    <message>
        <source>LED {led} stands where LED {needed} is needed. List the LEDs from 1 to {n_leds} in ascending order.</source>
        <translation>应为 LED {needed} 的地方是 LED {led}。请按升序列出 LED 1 至 {n_leds}。</translation>
    </message>
    <message>
        <source>LED {led} was found in no image. A finger may cover it, it may be off, or its place in the pen file may be wrong.</source>
        <translation>任何图像中都没有找到 LED {led}。可能被手指遮住、没有点亮，或在 LED 文件中的位置有误。</translation>
    </message>
    <message>
        <source>LED {led}, {column}: {flaw}</source>
        <translation>LED {led}，{column}：{flaw}</translation>
    </message>
    <message>
        <source>LED {led}: the normal {normal} does not have the length 1. Correct it; a disc that faces +z has the normal 0 0 1.</source>
        <translation>LED {led}：法向量 {normal} 的长度不为 1。请改正；朝 +z 的发光面法向量为 0 0 1。</translation>
    </message>
    <message>
        <source>LEDs 1 to 4 must have negative z. Change the sign of all z.</source>
        <translation>LED 1 至 4 的 z 必须为负。请改变所有 z 的符号。</translation>
    </message>
    <message>
        <source>LEDs 5 to 7 must have negative x and 8 to 10 positive x. Change the sign of all x, or exchange the columns if they are numbered the wrong way.</source>
        <translation>LED 5 至 7 的 x 必须为负，8 至 10 的 x 必须为正。请改变所有 x 的符号；若两列编号颠倒，请交换。</translation>
    </message>
    <message>
        <source>LEDs do not fit</source>
        <translation>LED 不匹配</translation>
    </message>
    <message>
        <source>LEDs seen: {seen}, needed: {needed}. A finger may cover them; or lean back a little.</source>
        <translation>看到 {seen} 个 LED，需要 {needed} 个。可能被手指遮住；或稍微往回倾斜。</translation>
    </message>
    <message>
        <source>LEDs {first} and {second} are exchanged: each stands where the other belongs. LEDs 1 to 4 must follow each other along the back line, and 5 to 7 and 8 to 10 along the columns in the same direction. Exchange their coordinates.</source>
        <translation>LED {first} 和 {second} 互换了：各自在对方的位置上。LED 1 至 4 必须沿后排直线依次排列，5 至 7 和 8 至 10 沿两列同方向依次排列。请交换它们的坐标。</translation>
    </message>
    <message>
        <source>LEDs {first} and {second} are {distance:.2f} mm apart, too close for discs of {diameter:g} mm. Check their coordinates and the diameter.</source>
        <translation>LED {first} 和 {second} 相距 {distance:.2f} mm，对 {diameter:g} mm 的发光面来说太近。请检查坐标和直径。</translation>
    </message>
    <message>
        <source>Lean the pen to the left and right as well as towards and away from the camera, and turn it about its own axis.</source>
        <translation>除了朝向和远离相机，请也向左右倾斜光笔，并绕自身轴线转动。</translation>
    </message>
    <message>
        <source>Lean the pen towards and away from the camera as well as to the left and right, and turn it about its own axis.</source>
        <translation>除了左右，请也朝向和远离相机倾斜光笔，并绕自身轴线转动。</translation>
    </message>
    <message>
        <source>Line {line} of {file} is damaged. Restore the file from a copy, or remove the line to go on without that image.</source>
        <translation>{file} 第 {line} 行已损坏。请用备份恢复文件，或删除该行，不用那幅图像继续。</translation>
    </message>
    <message>
        <source>Line {line} of {name}</source>
        <translation>{name} 第 {line} 行</translation>
    </message>
    <message>
        <source>Line {line} of {name} begins a document type definition, which can make a small file fill the memory. Remove it; a camera file of OpenCV has none.</source>
        <translation>{name} 第 {line} 行开始一个文档类型定义，它能使小文件占满内存。请删除；OpenCV 的内参文件中没有这种定义。</translation>
    </message>
    <message>
        <source>Line {line} of {name} has a cell of {n_characters} characters; at most {most} are read. Check that the right file is named.</source>
        <translation>{name} 第 {line} 行有一个长达 {n_characters} 个字符的单元格；最多读取 {most} 个。请检查文件是否选对。</translation>
    </message>
    <message>
        <source>Line {line} of {name} has a list in place of a name. Check that the right file is named.</source>
        <translation>{name} 第 {line} 行应为名称的地方是列表。请检查是否选对了文件。</translation>
    </message>
    <message>
        <source>Line {line} of {name} has the YAML anchor or alias {anchor}, which can make a small file fill the memory. Write the values out.</source>
        <translation>{name} 第 {line} 行有 YAML 锚点或别名 {anchor}，它能使小文件占满内存。请直接写出数值。</translation>
    </message>
    <message>
        <source>Line {line} of {name} has the tag {tag}. Such a tag can ask for code to be run, so only plain values and matrices of OpenCV are read. Remove the tag, or use a file from a source you trust.</source>
        <translation>{name} 第 {line} 行有标签 {tag}。这类标签可能要求运行代码，因此只读取普通数值和 OpenCV 矩阵。请删除该标签，或使用来源可信的文件。</translation>
    </message>
    <message>
        <source>Line {line} of {name} has {n_cells} cells where line {first_line} has {expected}. {hint}</source>
        <translation>{name} 第 {line} 行有 {n_cells} 个单元格，而第 {first_line} 行有 {expected} 个。{hint}</translation>
    </message>
    <message>
        <source>Line {line} of {name} has {n_characters} characters, which no row of a table has. Check that the right file is named.</source>
        <translation>{name} 第 {line} 行有 {n_characters} 个字符，表格的行不会这么长。请检查是否选对了文件。</translation>
    </message>
    <message>
        <source>Line {line} of {name} is not valid JSON ({problem}, column {column}). The file may be cut short: copy or export it again.</source>
        <translation>{name} 第 {line} 行不是有效的 JSON（{problem}，第 {column} 列）。文件可能不完整：请重新复制或导出。</translation>
    </message>
    <message>
        <source>Line {line} of {name} is not valid XML ({problem}). The file may be cut short: copy or export it again.</source>
        <translation>{name} 第 {line} 行不是有效的 XML（{problem}）。文件可能不完整：请重新复制或导出。</translation>
    </message>
    <message>
        <source>Line {line} of {name} is not valid YAML ({problem}). The file may be cut short: copy or export it again.</source>
        <translation>{name} 第 {line} 行不是有效的 YAML（{problem}）。文件可能不完整：请重新复制或导出。</translation>
    </message>
    <message>
        <source>Line {line} of {name}: the header names {column} twice. Give each column a name of its own.</source>
        <translation>{name} 第 {line} 行：表头中 {column} 出现两次。请给每一列不同的名称。</translation>
    </message>
    <message>
        <source>Line {line} of {name}: the quotation marks do not pair up. Remove or complete them.</source>
        <translation>{name} 第 {line} 行：引号不成对。请删除或补全。</translation>
    </message>
    <message>
        <source>Line {line} of {name}: {flaw}</source>
        <translation>{name} 第 {line} 行：{flaw}</translation>
    </message>
    <message>
        <source>Most images show fewer than {n_needed} spots (median {median:.0f}); of the {n_leds} LEDs of the pen {n_needed} must be seen. Check that the LEDs are lit and in the image, and the exposure.</source>
        <translation>多数图像中的光点少于 {n_needed} 个（中位数 {median:.0f}）；光笔的 {n_leds} 个 LED 中须看到 {n_needed} 个。请检查 LED 是否点亮并在图像内，以及曝光是否合适。</translation>
    </message>
    <message>
        <source>Most images show {n_needed} or more spots, but these do not fit the pen file with its {n_leds} LEDs. Check that it is the file of this pen and that the camera file belongs to these images.</source>
        <translation>多数图像中有 {n_needed} 个或更多光点，但与含 {n_leds} 个 LED 的 LED 文件不符。请检查该文件是否属于这支光笔，内参文件是否属于这些图像。</translation>
    </message>
    <message>
        <source>Next: accept the tip.</source>
        <translation>下一步：接受测头。</translation>
    </message>
    <message>
        <source>Next: capture more images; those of this swing are kept.</source>
        <translation>下一步：继续采集图像；本次摆动的图像会保留。</translation>
    </message>
    <message>
        <source>Next: check that camera file and LED file are of this camera and this pen.</source>
        <translation>下一步：检查内参文件和 LED 文件是否属于这台相机和这支光笔。</translation>
    </message>
    <message>
        <source>Next: check the LED file, then repeat.</source>
        <translation>下一步：检查 LED 文件，然后重做。</translation>
    </message>
    <message>
        <source>Next: check the intrinsics file and the LED file, then repeat.</source>
        <translation>下一步：检查内参文件和 LED 文件，然后重做。</translation>
    </message>
    <message>
        <source>Next: check the intrinsics file, then repeat.</source>
        <translation>下一步：检查内参文件，然后重做。</translation>
    </message>
    <message>
        <source>Next: check the rig file, then repeat.</source>
        <translation>下一步：检查相机组文件，然后重做。</translation>
    </message>
    <message>
        <source>Next: clamp cone and camera, then repeat the swing.</source>
        <translation>下一步：固定锥孔和相机，然后重新摆动。</translation>
    </message>
    <message>
        <source>Next: clean tip and artefact, clamp artefact and camera, and verify again.</source>
        <translation>下一步：清洁测头和标准件，夹紧标准件和相机，然后重新验证。</translation>
    </message>
    <message>
        <source>Next: hold the pen alike at each visit, take more images of a touch, or bring the camera nearer.</source>
        <translation>下一步：每次触测监视点时以相同姿态握持光笔，增加每次触测的图像数，或将相机移近。</translation>
    </message>
    <message>
        <source>Next: look at the pen, fix the LED, and measure the LEDs again.</source>
        <translation>下一步：检查光笔，固定该 LED，并重新测量各 LED。</translation>
    </message>
    <message>
        <source>Next: repeat the swing with the tip pressed in.</source>
        <translation>下一步：压紧测头，重做摆动。</translation>
    </message>
    <message>
        <source>Next: seat the tip firmly, calibrate it again, and verify the new result.</source>
        <translation>下一步：装紧测头，重新标定，并验证新的结果。</translation>
    </message>
    <message>
        <source>Next: see that it is the tip that is named, clean and tight, then repeat.</source>
        <translation>下一步：确认测头与所填写的一致、清洁且已拧紧，然后重做。</translation>
    </message>
    <message>
        <source>Next: see to the cause that is named, then repeat.</source>
        <translation>下一步：处理所指出的原因，然后重做。</translation>
    </message>
    <message>
        <source>Next: use the tip.</source>
        <translation>下一步：使用该测头。</translation>
    </message>
    <message>
        <source>No Dask scheduler answers at {address}. Check the address, such as tcp://10.0.0.5:8786, and that the scheduler runs.</source>
        <translation>{address} 处没有 Dask 调度器应答。请检查地址（例如 tcp://10.0.0.5:8786）以及调度器是否在运行。</translation>
    </message>
    <message>
        <source>No GenTL producer is installed: {variable} names no folder with a file {suffix}. Install the software of the camera, or open its file {suffix}.</source>
        <translation>没有安装 GenTL 生产者：{variable} 指定的文件夹中没有 {suffix} 文件。请安装相机的软件，或打开它的 {suffix} 文件。</translation>
    </message>
    <message>
        <source>No LED has moved against the others over {n_swings} swings.</source>
        <translation>在 {n_swings} 次摆动中，没有 LED 相对其他 LED 移动。</translation>
    </message>
    <message>
        <source>No camera sees a flat board {board} as the points have it: it has other squares than said, or the images are not of one camera. Count and measure its squares again.</source>
        <translation>没有相机会把平整标定板 {board} 看成这些点的样子：格子与所指定的不符，或图像不是同一相机拍摄。请重新数并测量格子。</translation>
    </message>
    <message>
        <source>No image came for {waited:.1f} s. Check the camera.</source>
        <translation>{waited:.1f} s 内没有收到图像。请检查相机。</translation>
    </message>
    <message>
        <source>No image of {place} can be read any more. Connect its disk or put the images back, or choose others.</source>
        <translation>{place} 的图像已无法读取。请连接磁盘或放回图像，或选择其他图像。</translation>
    </message>
    <message>
        <source>No image shows a chessboard of {columns} x {rows} inner corners, but a part of a larger one, of which {seen_columns} x {seen_rows} are seen. Count the inner corners of the whole board again.</source>
        <translation>没有图像显示有 {columns} x {rows} 个内角点的棋盘格，而是显示了一个更大棋盘格的一部分，其中可见 {seen_columns} x {seen_rows} 个内角点。请重新数整个标定板的内角点。</translation>
    </message>
    <message>
        <source>No image shows a chessboard of {columns} x {rows} inner corners, but one of {seen_columns} x {seen_rows}. Count its inner corners again.</source>
        <translation>图像中没有 {columns} x {rows} 内角点的棋盘格，看到的是 {seen_columns} x {seen_rows}。请重新数内角点。</translation>
    </message>
    <message>
        <source>No image shows the board {board}, but they show {other}: OpenCV laid it out otherwise until 4.6. Give that board.</source>
        <translation>图像中没有标定板 {board}，看到的是 {other}：OpenCV 4.6 及更早版本的排布不同。请指定该标定板。</translation>
    </message>
    <message>
        <source>No image shows the board {board}, but they show {other}: columns and rows are the other way round. Give that board.</source>
        <translation>图像中没有标定板 {board}，看到的是 {other}：列数与行数颠倒了。请指定该标定板。</translation>
    </message>
    <message>
        <source>No space left on device</source>
        <translation>设备上没有空间</translation>
    </message>
    <message>
        <source>No such file or directory</source>
        <translation>没有那个文件或目录</translation>
    </message>
    <message>
        <source>No tip is in force for tip {tip} of pen {pen}. Calibrate it and accept the result; then it can be verified.</source>
        <translation>光笔 {pen} 的测头 {tip} 没有有效的结果。请先标定并接受结果，然后才能验证。</translation>
    </message>
    <message>
        <source>No view reaches these corners of the image: {corners}.</source>
        <translation>没有视图覆盖图像的这些角：{corners}。</translation>
    </message>
    <message>
        <source>Nobody can listen at {place}: {reason}. Choose a port from 1024 to 65535 that is free.</source>
        <translation>无法在 {place} 接收：{reason}。请选择 1024 到 65535 之间空闲的端口。</translation>
    </message>
    <message>
        <source>Nominal tip, {axis}: {flaw}</source>
        <translation>标称测头，{axis}：{flaw}</translation>
    </message>
    <message>
        <source>None of the {n_images} images can be read. {why}</source>
        <translation>{n_images} 幅图像都无法读取。{why}</translation>
    </message>
    <message>
        <source>None of the {n_images} images shows the board {board}. The whole board must be in the image, sharp, with a bright rim round it; check its kind and count.</source>
        <translation>{n_images} 幅图像中均未找到标定板 {board}。整块板须在图像内且清晰，四周留有亮边；请检查其类型和点数。</translation>
    </message>
    <message>
        <source>Not a directory</source>
        <translation>不是目录</translation>
    </message>
    <message>
        <source>Nothing can be kept in the data folder {folder}: {reason}</source>
        <translation>数据文件夹 {folder} 中无法保存任何内容：{reason}</translation>
    </message>
    <message>
        <source>Nothing is chosen to be touched. Choose the fixed point, the ring or the length.</source>
        <translation>没有选择要触测的内容。请选择固定点、圆环或长度。</translation>
    </message>
    <message>
        <source>Odd and even images put the tip {difference:.4f} mm apart, {usual:.4f} mm is usual. The tip may have moved: repeat the swing with the tip pressed in.</source>
        <translation>奇数与偶数图像求得的测头相差 {difference:.4f} mm，通常为 {usual:.4f} mm。测头可能移动过：请压紧测头，重做摆动。</translation>
    </message>
    <message>
        <source>One swing tells nothing of how a pen changes; give two at least.</source>
        <translation>仅凭一次摆动看不出光笔的变化；请至少给出两次。</translation>
    </message>
    <message>
        <source>Operation not permitted</source>
        <translation>不允许的操作</translation>
    </message>
    <message>
        <source>Permission denied</source>
        <translation>权限不够</translation>
    </message>
    <message>
        <source>Port {port} is in use already, by another window or another program. Choose another port, or close that one.</source>
        <translation>端口 {port} 已被另一个窗口或程序占用。请选择其他端口，或关闭那个程序。</translation>
    </message>
    <message>
        <source>Press the tip into the cone and keep it there.</source>
        <translation>把测头压入锥孔并保持。</translation>
    </message>
    <message>
        <source>Press the tip into the cone and swing the pen gently.</source>
        <translation>把测头压入锥孔，轻轻摆动光笔。</translation>
    </message>
    <message>
        <source>Put the tip into the cone and hold it still, each time leant another way: {n_touches} of {needed}.</source>
        <translation>把测头放入锥孔并保持不动，每次向不同方向倾斜：{n_touches} / {needed}。</translation>
    </message>
    <message>
        <source>RadialDistortion in {name} has {counted} where 2 or 3 are needed. Correct it, or export the file again.</source>
        <translation>{name} 中的 RadialDistortion 有 {counted}，需要 2 或 3 个。请改正，或重新导出文件。</translation>
    </message>
    <message>
        <source>Read-only file system</source>
        <translation>只读文件系统</translation>
    </message>
    <message>
        <source>Recorded images</source>
        <translation>录制的图像</translation>
    </message>
    <message>
        <source>Show the camera the pen that the tip belongs to.</source>
        <translation>请让相机看到该测头所属的光笔。</translation>
    </message>
    <message>
        <source>Simulated pen</source>
        <translation>模拟光笔</translation>
    </message>
    <message>
        <source>Streaming needs the package pyigtl, which is not installed. Install it with: pip install &quot;lightpen[stream]&quot;.</source>
        <translation>实时数据流需要 pyigtl 软件包，但尚未安装。安装命令：pip install &quot;lightpen[stream]&quot;。</translation>
    </message>
    <message>
        <source>Swings given: {n_swings}. {needed} are needed to pool, and one more to confirm what comes of them.</source>
        <translation>给出的摆动次数：{n_swings}。合并需要 {needed} 次，另需一次来确认所得结果。</translation>
    </message>
    <message>
        <source>The GenTL producer {file} does not load: {why}. Choose the producer of this camera, for this system and 64 bit.</source>
        <translation>无法加载 GenTL 生产者 {file}：{why}。请选择适用于此相机、此系统和 64 位的生产者。</translation>
    </message>
    <message>
        <source>The LED centres reach to ({x:.0f}, {y:.0f}) px, the camera file was made for {width} x {height} px. Choose the file for this camera.</source>
        <translation>LED 中心最远到 ({x:.0f}, {y:.0f}) px，而内参文件适用于 {width} × {height} px。请选择这台相机的文件。</translation>
    </message>
    <message>
        <source>The LED discs cannot be {diameter:g} mm wide. Give a diameter of up to {most:g} mm.</source>
        <translation>LED 发光面直径不可能是 {diameter:g} mm。请给出不超过 {most:g} mm 的直径。</translation>
    </message>
    <message>
        <source>The LED file is off by {sigma:.3f} mm a coordinate, which alone makes U (k = 2) {uncertainty:.4f} mm. Is this the LED file of this pen? More images hardly help.</source>
        <translation>LED 文件每个坐标的误差约为 {sigma:.3f} mm，仅此就使 U (k = 2) 达到 {uncertainty:.4f} mm。这是该光笔的 LED 文件吗？增加图像作用不大。</translation>
    </message>
    <message>
        <source>The LED positions do not fit the images: {sigma:.1f} px, {usual} px or less is usual. Check that the pen file is of this pen with its LEDs in order, and the camera file of this camera.</source>
        <translation>LED 位置与图像不符：{sigma:.1f} px，通常不超过 {usual} px。请检查 LED 文件是否属于这支光笔且编号顺序正确，内参文件是否属于这台相机。</translation>
    </message>
    <message>
        <source>The LEDs are a mirror image of the pen: seen from the front with LED 4 above LED 1, LEDs 5 to 7 must be on the left and 8 to 10 on the right. If the machine&apos;s axes are left-handed, change the sign of one coordinate; if the columns are exchanged, number them anew.</source>
        <translation>LED 是光笔的镜像：从正面看，LED 4 在 LED 1 上方时，LED 5 至 7 必须在左，8 至 10 在右。若测量机为左手坐标系，请改变一个坐标的符号；若两列颠倒，请重新编号。</translation>
    </message>
    <message>
        <source>The LEDs are mirrored in {axis}, a left-handed frame: LED {led} has {axis} = {found:.2f} mm in place of {needed:.2f} mm. {rule}</source>
        <translation>LED 沿 {axis} 镜像，是左手坐标系：LED {led} 的 {axis} = {found:.2f} mm，应为 {needed:.2f} mm。{rule}</translation>
    </message>
    <message>
        <source>The LEDs are neither in the pen frame nor right-handed: they are a mirror image of the pen. Change the sign of one coordinate, then put them into the pen frame.</source>
        <translation>LED 既不在光笔坐标系中，也不是右手系：它们是光笔的镜像。请改变一个坐标的符号，再转换到光笔坐标系。</translation>
    </message>
    <message>
        <source>The LEDs are not in the pen frame: LED {led} is {distance:.2f} mm from where the frame puts it (origin in front of LED 1, y along LEDs 1 to 4, LEDs 5 to 10 at z = 0). If these are a measuring machine&apos;s coordinates, put them into the pen frame.</source>
        <translation>LED 不在光笔坐标系中：LED {led} 偏离坐标系规定的位置 {distance:.2f} mm（原点在 LED 1 前方，y 轴沿 LED 1 至 4，LED 5 至 10 位于 z = 0）。如果是测量机坐标，请转换到光笔坐标系。</translation>
    </message>
    <message>
        <source>The LEDs are out of order: LED {places}. LEDs 1 to 4 must follow each other along the back line, and 5 to 7 and 8 to 10 along the columns in the same direction. Number them so.</source>
        <translation>LED 编号顺序错误：{places}。LED 1 至 4 必须沿后排直线依次排列，5 至 7 和 8 至 10 沿两列同方向依次排列。请照此编号。</translation>
    </message>
    <message>
        <source>The LEDs are smeared. Swing the pen slowly.</source>
        <translation>LED 有拖影。请慢慢摆动光笔。</translation>
    </message>
    <message>
        <source>The LEDs do not stand as the pen frame needs it: ten LEDs, 1 to 4 in a line behind the plane of 5 to 10, and these in two columns of three parallel to the line, all within {tolerance:g} mm. {misfit} Measure the LEDs again, or give a pen of another layout in a frame of its own.</source>
        <translation>LED 的排列不符合光笔坐标系的要求：十个 LED，1 至 4 在 5 至 10 的平面后方成一直线，5 至 10 分成两列、每列三个并与该直线平行，偏差均在 {tolerance:g} mm 以内。{misfit}请重新测量 LED，或用其自身坐标系给出其他布局的光笔。</translation>
    </message>
    <message>
        <source>The LEDs look about {factor:g} times as large as the pen file says ({diameter:g} mm). Check the disc diameter and the unit of the coordinates.</source>
        <translation>LED 看起来约为 LED 文件所述大小（{diameter:g} mm）的 {factor:g} 倍。请检查发光面直径和坐标单位。</translation>
    </message>
    <message>
        <source>The LEDs of this pen look the same when it is turned or mirrored, so they cannot be told apart. Move an LED, or give the LED centres.</source>
        <translation>这支光笔旋转或镜像后 LED 看起来一样，因此无法区分。请移动一个 LED，或直接给出 LED 中心。</translation>
    </message>
    <message>
        <source>The LEDs span only {extent:.4g} mm, less than one disc of {diameter:g} mm. Are the coordinates in metres? Then name the units, such as in the header: x_m, y_m, z_m.</source>
        <translation>LED 的跨度仅 {extent:.4g} mm，小于一个 {diameter:g} mm 的发光面。坐标是以米为单位吗？那就请指定单位，例如在表头中写 x_m, y_m, z_m。</translation>
    </message>
    <message>
        <source>The LEDs span {extent:.6g} m; a pen spans at most {most:g} m. Check that the coordinates are in millimetres, in the header too, or name their units.</source>
        <translation>LED 的跨度为 {extent:.6g} m；光笔最多为 {most:g} m。请检查坐标及表头是否以毫米为单位，或指定单位。</translation>
    </message>
    <message>
        <source>The LEDs stand in a line within {off_line:.2f} mm over {extent:.0f} mm, so a turn about it could not be seen. At least one LED must stand {needed:.1f} mm off the line.</source>
        <translation>LED 在 {extent:.0f} mm 长度内偏离直线不超过 {off_line:.2f} mm，因此看不出绕该直线的转动。至少有一个 LED 须偏离直线 {needed:.1f} mm。</translation>
    </message>
    <message>
        <source>The archive cannot be exported to {file}: {reason}. Free some space, or choose another folder.</source>
        <translation>无法将档案库导出到 {file}：{reason}。请释放一些空间，或选择其他文件夹。</translation>
    </message>
    <message>
        <source>The archive does not tell enough of entry {number} to put its tip in force: its record is missing, or of an early version of the program. Calibrate the tip again.</source>
        <translation>档案库中条目 {number} 的内容不足以使其测头数据生效：其记录缺失，或来自程序的早期版本。请重新标定该测头。</translation>
    </message>
    <message>
        <source>The archive is closed: the program ends.</source>
        <translation>档案库已关闭：程序正在结束。</translation>
    </message>
    <message>
        <source>The archive {name} cannot be used: {reason}. See that its disk is not full and yours to write, or that its server runs and knows the user and the password.</source>
        <translation>无法使用档案库 {name}：{reason}。请确认磁盘未满且您有写入权限，或其服务器正在运行且用户名和密码正确。</translation>
    </message>
    <message>
        <source>The archive {name} was written by a later version of the program, and stays as it is. Use that version.</source>
        <translation>档案库 {name} 由更新版本的程序写入，现保持原样。请使用该版本。</translation>
    </message>
    <message>
        <source>The board faces fewer than {least} times {sides}.</source>
        <translation>标定板朝以下方向倾斜的视图不足 {least} 幅：{sides}。</translation>
    </message>
    <message>
        <source>The board is bent by {bend:.2f} mm, {stated:.2f} mm was assumed. That is taken into account, but mount it on a flat plate.</source>
        <translation>标定板弯曲 {bend:.2f} mm，假定值为 {stated:.2f} mm。计算中已考虑，但请将其固定在平板上。</translation>
    </message>
    <message>
        <source>The board is not what {board} says: its lengths along the rows are {stretch:+.2%} longer than down the columns, and its right angles are off by {shear:+.2f} degrees. It may be printed to fit the page, or its squares are none. Print it at true scale, or measure it again.</source>
        <translation>标定板与 {board} 不符：沿行方向的长度比沿列方向长 {stretch:+.2%}，直角偏差 {shear:+.2f} 度。打印时可能选择了“适合页面”，或格子不是正方形。请按实际尺寸打印，或重新测量。</translation>
    </message>
    <message>
        <source>The board is seen in {n_views} images; at least {least} are needed, {enough} are better. Add views with the board tilted by 20 to 40 degrees to each side, and in each corner of the image.</source>
        <translation>有 {n_views} 幅图像看到标定板，至少需要 {least} 幅，最好有 {enough} 幅。请补充标定板向各侧倾斜 20 至 40 度以及位于图像各角的视图。</translation>
    </message>
    <message>
        <source>The board {board} is {width:.0f} x {height:.0f} mm large and needs {foot:g} mm of white round it, more than the paper has. Choose a larger paper, or a smaller board.</source>
        <translation>标定板 {board} 大小为 {width:.0f} x {height:.0f} mm，四周还需 {foot:g} mm 白边，超出纸张。请选更大的纸张或更小的标定板。</translation>
    </message>
    <message>
        <source>The board {text} has {columns} x {rows} points or squares; {least} to {most} are needed along each side. Count them again: of a chessboard it is the inner corners that count.</source>
        <translation>标定板 {text} 有 {columns} x {rows} 个点或格子，每边需要 {least} 至 {most} 个。请重新数：棋盘格按内角点计。</translation>
    </message>
    <message>
        <source>The board {text} names markers that are not known here. Name the dictionary as OpenCV does, such as DICT_5X5_100.</source>
        <translation>标定板 {text} 指定的标记字典未知。请按 OpenCV 的写法命名字典，例如 DICT_5X5_100。</translation>
    </message>
    <message>
        <source>The board {text} needs {needed} markers, {dictionary} has {known}. Name the dictionary that it was printed from.</source>
        <translation>标定板 {text} 需要 {needed} 个标记，而 {dictionary} 只有 {known} 个。请指定打印时所用的字典。</translation>
    </message>
    <message>
        <source>The calibration {path} is not as it was written: it was changed or damaged since. Restore it from a copy, or calibrate again.</source>
        <translation>标定结果 {path} 与写出时不同：此后被改动或损坏。请从副本恢复，或重新标定。</translation>
    </message>
    <message>
        <source>The camera file is of the camera {stated}, the camera in use is {used}. Give the file of this camera.</source>
        <translation>内参文件属于相机 {stated}，而当前使用的相机是 {used}。请提供该相机的文件。</translation>
    </message>
    <message>
        <source>The camera matrix of {name} is not of the form fx 0 cx, 0 fy cy, 0 0 1; it may be transposed or incomplete. Export the file again.</source>
        <translation>{name} 的相机矩阵不是 fx 0 cx, 0 fy cy, 0 0 1 的形式；可能被转置或不完整。请重新导出文件。</translation>
    </message>
    <message>
        <source>The camera moved by {shift:.1f} px: fixed lamps in view shift by {moved:.4f} mm where the pen is (U {uncertainty:.4f} mm, limit {limit:.4f} mm). What was touched is off by as much, which its U counts.</source>
        <translation>相机移动了 {shift:.1f} px：视野中固定的灯在光笔处偏移了 {moved:.4f} mm（U {uncertainty:.4f} mm，限值 {limit:.4f} mm）。所测各点偏差与此相当，已计入其 U。</translation>
    </message>
    <message>
        <source>The camera moved during the swing: fixed lamps in view shift by {shift:.2f} px, and the pen with them. It is taken out. Clamp the camera, and let it warm up.</source>
        <translation>相机在摆动过程中移动了：视野中的固定灯移动了 {shift:.2f} px，光笔也随之移动。此移动已被扣除。请固定相机，并让其充分预热。</translation>
    </message>
    <message>
        <source>The camera sends no images in the pixel format {wanted} that can be used; it offers {offered}. Choose Mono8, or another of Mono8 to Mono16.</source>
        <translation>相机不能以像素格式 {wanted} 送来可用的图像；它提供 {offered}。请选择 Mono8，或 Mono8 到 Mono16 中的另一种。</translation>
    </message>
    <message>
        <source>The camera sends {sent:.1f} images a second, not the {wanted:.1f} that are set: its link or its exposure allows no more. Lower the frame rate, or take a smaller region or a shorter exposure.</source>
        <translation>相机每秒送来 {sent:.1f} 幅图像，而不是设定的 {wanted:.1f} 幅：其链路或曝光不允许更多。请降低帧率，或使用更小的区域或更短的曝光。</translation>
    </message>
    <message>
        <source>The camera stands still: fixed lamps in view shift by {moved:.4f} mm where the pen is (U {uncertainty:.4f} mm, limit {limit:.4f} mm).</source>
        <translation>相机保持不动：视野中的固定灯在光笔处移动 {moved:.4f} mm（U {uncertainty:.4f} mm，限值 {limit:.4f} mm）。</translation>
    </message>
    <message>
        <source>The camera was calibrated at {stated:.1f} degrees Celsius, the station is at {used:.1f}. Check it by a swing, or calibrate it again at this temperature.</source>
        <translation>相机标定时为 {stated:.1f} 摄氏度，工位现为 {used:.1f} 摄氏度。请用一次摆动检查，或在此温度下重新标定。</translation>
    </message>
    <message>
        <source>The camera was calibrated {age} days ago, on {day}. Check it by a swing, or calibrate it again.</source>
        <translation>相机标定于 {age} 天前（{day}）。请用一次摆动检查，或重新标定。</translation>
    </message>
    <message>
        <source>The camera {serial} did not stop within {waited:.0f} s. Unplug it, and start the program again before you use it.</source>
        <translation>相机 {serial} 在 {waited:.0f} s 内没有停止。请拔下相机，重新启动程序后再使用。</translation>
    </message>
    <message>
        <source>The camera {serial} no longer answers ({why}). Check its cable and its power.</source>
        <translation>相机 {serial} 不再响应（{why}）。请检查线缆和电源。</translation>
    </message>
    <message>
        <source>The camera {serial} refuses a setting: {why}. Choose another.</source>
        <translation>相机 {serial} 拒绝一项设置：{why}。请另选。</translation>
    </message>
    <message>
        <source>The camera {serial} sent no image for {silence:.0f} s. Check its cable and its power.</source>
        <translation>相机 {serial} 已有 {silence:.0f} s 没有送来图像。请检查线缆和电源。</translation>
    </message>
    <message>
        <source>The camera {serial} sent no image for {waited:.1f} s. Check its cable and its trigger.</source>
        <translation>相机 {serial} 已有 {waited:.1f} s 没有送来图像。请检查线缆和触发。</translation>
    </message>
    <message>
        <source>The cameras are not synchronised: they take their images {lag:.1f} ms apart. At 100 mm/s the pen moves {way:.2f} mm meanwhile, {px:.1f} px in the image. Trigger both cameras by one signal.</source>
        <translation>两台相机不同步：曝光时刻相差 {lag:.1f} ms。光笔以 100 mm/s 运动时，其间移动 {way:.2f} mm，在图像中为 {px:.1f} px。请用同一信号触发两台相机。</translation>
    </message>
    <message>
        <source>The cameras are not synchronised: they take their images {lag:.1f} ms apart. At 100 mm/s the pen moves {way:.2f} mm meanwhile. Trigger both cameras by one signal.</source>
        <translation>两台相机不同步：曝光时刻相差 {lag:.1f} ms。光笔以 100 mm/s 运动时，其间移动 {way:.2f} mm。请用同一信号触发两台相机。</translation>
    </message>
    <message>
        <source>The cameras are not synchronised: {camera} is out of step by {lag:.1f} ± {u:.1f} ms, which costs {px:.2f} px at a pen&apos;s speed of 100 mm/s. Trigger both cameras by one signal.</source>
        <translation>两台相机不同步：{camera} 相差 {lag:.1f} ± {u:.1f} ms，光笔以 100 mm/s 移动时相当于 {px:.2f} px。请用同一信号触发两台相机。</translation>
    </message>
    <message>
        <source>The cameras are not synchronised: {camera} is out of step by {lag:.2f} ± {u:.2f} of the time between two views. Each millisecond costs {px:.2f} px at a pen&apos;s speed of 100 mm/s. Trigger both cameras by one signal.</source>
        <translation>两台相机不同步：{camera} 相差两幅视图间隔的 {lag:.2f} ± {u:.2f} 倍。光笔以 100 mm/s 移动时，每毫秒相当于 {px:.2f} px。请用同一信号触发两台相机。</translation>
    </message>
    <message>
        <source>The chain {chain} does not end with the entry that was entered last.</source>
        <translation>链 {chain} 的末尾不是最后录入的那个条目。</translation>
    </message>
    <message>
        <source>The cone moved by {distance:.4f} mm against the camera during the swing. Clamp both, let the camera warm up, and repeat. It is in the uncertainty.</source>
        <translation>摆动期间锥孔相对相机移动了 {distance:.4f} mm。请将两者夹紧，待相机预热后重做。该影响已计入不确定度。</translation>
    </message>
    <message>
        <source>The difference from the tip that was in force before is accepted up to {gate:g} times U (k = 2) of the difference along each axis, with which an unchanged tip is accepted in 95 % of all cases; beyond it, or where that tip cannot be read, is CHECK. A CHECK is put in force only with a reason, a REPEAT not at all.</source>
        <translation>与此前生效的测头之差，各轴均不超过该差值 U (k = 2) 的 {gate:g} 倍时予以接受；测头未变时，按此准则接受的概率为 95 %。超出此值，或无法读取此前的测头时，判为“需检查”。判为“需检查”的测头须注明理由才能生效，判为“重做”的不得生效。</translation>
    </message>
    <message>
        <source>The distortion coefficients of {name} fold the image of {width} x {height} px: some pixels have no direction of view, or two. Check them, or calibrate the camera again with views that reach into the corners.</source>
        <translation>{name} 的畸变系数使 {width} × {height} px 的图像折叠：有些像素没有视线方向，或有两个。请检查这些系数，或用覆盖到图像边角的视图重新标定相机。</translation>
    </message>
    <message>
        <source>The distortion that the views tell turns the image over in its corners, where no view shows the board. Add views with the board in each corner of the image.</source>
        <translation>由这些视图得出的畸变使图像在角部翻折，而那里没有视图显示标定板。请补充标定板位于图像各角的视图。</translation>
    </message>
    <message>
        <source>The file has {n_leds} LEDs.</source>
        <translation>文件有 {n_leds} 个 LED。</translation>
    </message>
    <message>
        <source>The file of the result of tip {tip}, pen {pen}, is not in {folder} any more. Restore it from a copy.</source>
        <translation>测头 {tip}（光笔 {pen}）的结果文件已不在 {folder} 中。请从备份恢复。</translation>
    </message>
    <message>
        <source>The file {file} is damaged: {what}.</source>
        <translation>文件 {file} 已损坏：{what}。</translation>
    </message>
    <message>
        <source>The file {file} of entry {number} is missing.</source>
        <translation>第 {number} 个条目的文件 {file} 缺失。</translation>
    </message>
    <message>
        <source>The file {file} of entry {number} is not as it was entered.</source>
        <translation>第 {number} 个条目的文件 {file} 与录入时不符。</translation>
    </message>
    <message>
        <source>The file {file} of the tip library was written by a later version of the program. Use that version.</source>
        <translation>测头库文件 {file} 由更新版本的程序写成。请使用该版本。</translation>
    </message>
    <message>
        <source>The file {file} was changed since it was closed.</source>
        <translation>文件 {file} 在关闭之后被改动过。</translation>
    </message>
    <message>
        <source>The file {path} cannot be read: {reason}. Check the name and that it is yours to read.</source>
        <translation>文件 {path} 无法读取：{reason}。请检查名称和读取权限。</translation>
    </message>
    <message>
        <source>The first camera of {name}, {camera}, is the reference of the rig: its cam_from_rig must be the identity. List the reference camera first, and give the others from its frame.</source>
        <translation>{name} 中的第一台相机 {camera} 是相机组的基准：其 cam_from_rig 必须是单位变换。请把基准相机列在第一位，其余相机均相对于它的坐标系给出。</translation>
    </message>
    <message>
        <source>The fixed point is done: this touch of the cone does not count. Touch the ring.</source>
        <translation>固定点已完成：这次对锥孔的触测不计入。请触测圆环。</translation>
    </message>
    <message>
        <source>The folder {folder} cannot be made: {reason}. Make sure that it is yours to write.</source>
        <translation>无法创建文件夹 {folder}：{reason}。请确认您有写入权限。</translation>
    </message>
    <message>
        <source>The folder {folder} cannot be read: {reason}. Interrupted swings in it are not offered; make sure that it is yours to read.</source>
        <translation>文件夹 {folder} 无法读取：{reason}。其中未完成的摆动不会列出；请确认您有读取权限。</translation>
    </message>
    <message>
        <source>The folder {folder} holds no images ({suffixes}). Name the folder that the images are in.</source>
        <translation>文件夹 {folder} 中没有图像 ({suffixes})。请指定图像所在的文件夹。</translation>
    </message>
    <message>
        <source>The folder {folder} is not empty. Choose another for this swing; nothing is overwritten.</source>
        <translation>文件夹 {folder} 不是空的。请为本次摆动选择其他文件夹；不会覆盖任何内容。</translation>
    </message>
    <message>
        <source>The images contradict the LED file: its coordinates are off by {found:.4f} mm (standard deviation), the file states {stated:.4f} mm. Measure the pen again, or check that the file is of this pen.</source>
        <translation>图像与 LED 文件不符：其坐标偏差为 {found:.4f} mm（标准差），文件给出 {stated:.4f} mm。请重新测量光笔，或检查该文件是否属于此光笔。</translation>
    </message>
    <message>
        <source>The images contradict the LED file: they want the {what} to be {wanted:.6g} ± {wanted_u:.2g}{unit}, the file says {stated:.6g} ± {stated_u:.2g}{unit}. Check that the file is of this pen, or measure the pen again.</source>
        <translation>图像与 LED 文件矛盾：图像要求{what}为 {wanted:.6g} ± {wanted_u:.2g}{unit}，文件给出 {stated:.6g} ± {stated_u:.2g}{unit}。请检查该文件是否属于这支光笔，或重新测量这支光笔。</translation>
    </message>
    <message>
        <source>The images contradict the camera file: they want the {what} to be {wanted:.6g} ± {wanted_u:.2g}{unit}, the file says {stated:.6g} ± {stated_u:.2g}{unit}. Check that the file is of this camera, lens and focus, or calibrate the camera again.</source>
        <translation>图像与内参文件不符：按图像，{what}应为 {wanted:.6g} ± {wanted_u:.2g}{unit}，文件为 {stated:.6g} ± {stated_u:.2g}{unit}。请检查该文件是否属于此相机、镜头和对焦，或重新标定相机。</translation>
    </message>
    <message>
        <source>The images contradict the file of camera {camera}: they want the {what} to be {wanted:.6g} ± {wanted_u:.2g}{unit}, the file says {stated:.6g} ± {stated_u:.2g}{unit}. Check that the file is of this camera, lens and focus, or calibrate the camera again.</source>
        <translation>图像与相机 {camera} 的文件相矛盾：按图像，{what}应为 {wanted:.6g} ± {wanted_u:.2g}{unit}，文件中为 {stated:.6g} ± {stated_u:.2g}{unit}。请检查该文件是否对应此相机、镜头和对焦，或重新标定相机。</translation>
    </message>
    <message>
        <source>The images contradict the rig file: of camera {camera} they want the {what} to be {wanted:.6g} ± {wanted_u:.2g}{unit}, the file says {stated:.6g} ± {stated_u:.2g}{unit}. Check that no camera was moved since, or calibrate the rig again.</source>
        <translation>图像与相机组文件相矛盾：按图像，相机 {camera} 的{what}应为 {wanted:.6g} ± {wanted_u:.2g}{unit}，文件中为 {stated:.6g} ± {stated_u:.2g}{unit}。请检查此后是否有相机移动过，或重新标定相机组。</translation>
    </message>
    <message>
        <source>The images do not tell yet where the tip is. Lean the pen to all sides.</source>
        <translation>目前的图像还不能确定测头位置。请向各个方向倾斜光笔。</translation>
    </message>
    <message>
        <source>The images fit LED coordinates {factor:g} times those of the pen file. Check its unit: millimetres are needed.</source>
        <translation>图像与 LED 文件坐标的 {factor:g} 倍相符。请检查文件的单位：需要毫米。</translation>
    </message>
    <message>
        <source>The images fit the mirror image of the pen: with the opposite sign of {axis} its LEDs match. Change the sign of {axis} in the pen file.</source>
        <translation>图像与光笔的镜像相符：{axis} 取相反符号时 LED 吻合。请在 LED 文件中改变 {axis} 的符号。</translation>
    </message>
    <message>
        <source>The images fit the pen with about {factor:g} times the focal length of the camera file. Choose the file of this camera and lens, or calibrate the camera again.</source>
        <translation>图像与内参文件焦距的约 {factor:g} 倍相符。请选择这台相机和镜头的文件，或重新标定相机。</translation>
    </message>
    <message>
        <source>The images of camera {camera} are paired with those of other moments: its image {own} fits image {others} of the other cameras, and so on. Give the images of one moment the same name; some may be missing at the start.</source>
        <translation>相机 {camera} 的图像与其他时刻的图像配成了对：它的第 {own} 幅图像对应其他相机的第 {others} 幅，依此类推。请让同一时刻的图像同名；开头可能缺少若干图像。</translation>
    </message>
    <message>
        <source>The images show the board {board} mirrored. Switch off the mirroring of the camera, or print the board anew.</source>
        <translation>图像中的标定板 {board} 是镜像的。请关闭相机的镜像功能，或重新打印标定板。</translation>
    </message>
    <message>
        <source>The intrinsics_covariance of {name} is not a covariance: it must be symmetric, with correlations from -1 to 1. Correct or remove it.</source>
        <translation>{name} 的 intrinsics_covariance 不是协方差：必须对称，相关系数在 -1 到 1 之间。请改正或删除。</translation>
    </message>
    <message>
        <source>The joint fit did not settle in {n_steps} steps. The images may not be of this pen and camera: check both files.</source>
        <translation>联合拟合在 {n_steps} 步内未收敛。图像可能不属于这支光笔和这台相机：请检查两个文件。</translation>
    </message>
    <message>
        <source>The lamp at {x:.0f}, {y:.0f} px moved by {shift:.2f} px during the swing, and the pen did not move with it. Nothing is taken out. Fix the lamp, or cover it.</source>
        <translation>位于 {x:.0f}, {y:.0f} px 的灯在摆动过程中移动了 {shift:.2f} px，而光笔没有随之移动。未作任何扣除。请固定该灯，或将其遮住。</translation>
    </message>
    <message>
        <source>The led_covariance of {name} is none: it must be symmetric, and no variance below 0. Leave it away, or give it as it was written.</source>
        <translation>{name} 的 led_covariance 不是协方差矩阵：它必须对称，且方差不得小于 0。请去掉它，或按原样给出。</translation>
    </message>
    <message>
        <source>The length at {run} is off by {error:+.4f} mm (U {uncertainty:.4f} mm, limit {limit:.4f} mm). Is it the certified length of this bar? Else the scale of the LED file or the camera file is wrong, or the pen is warmer than when it was measured.</source>
        <translation>{run} 处的长度偏差 {error:+.4f} mm（U {uncertainty:.4f} mm，限值 {limit:.4f} mm）。输入的是这根标准棒的证书长度吗？否则是 LED 文件的尺度或内参文件有误，或光笔比测量 LED 时更热。</translation>
    </message>
    <message>
        <source>The length is not known. Enter the certified one.</source>
        <translation>长度未知。请输入证书长度。</translation>
    </message>
    <message>
        <source>The length is off by {error:+.4f} mm at most (U {uncertainty:.4f} mm, limit {limit:.4f} mm).</source>
        <translation>长度最大偏差 {error:+.4f} mm（U {uncertainty:.4f} mm，限值 {limit:.4f} mm）。</translation>
    </message>
    <message>
        <source>The lengths of the board {text} cannot be: they are in mm, above 0, and markers or circles are smaller than what they stand in. Measure them again.</source>
        <translation>标定板 {text} 的尺寸不合理：单位为 mm，须大于 0，且标记或圆须小于其所在的格子。请重新测量。</translation>
    </message>
    <message>
        <source>The lens distortion of the camera file cannot be undone for some image points: its coefficients fold the image. Check the distortion coefficients, or calibrate the camera again.</source>
        <translation>内参文件的镜头畸变在某些像点无法消除：其系数使图像折叠。请检查畸变系数，或重新标定相机。</translation>
    </message>
    <message>
        <source>The limits in {file} are not as they were laid down: they were changed or damaged since. Restore the file from a copy.</source>
        <translation>{file} 中的限值与当初规定的不同：此后被改动或损坏。请从副本恢复该文件。</translation>
    </message>
    <message>
        <source>The line, the plane and the columns are not parallel, or too close.</source>
        <translation>直线、平面和两列不平行，或相距太近。</translation>
    </message>
    <message>
        <source>The link to the camera loses images: of {n_sent}, {n_incomplete} came incomplete and {n_missed} not at all. Lower the frame rate, take a smaller region or larger packets, or check cable and switch.</source>
        <translation>到相机的链路丢失图像：{n_sent} 幅中有 {n_incomplete} 幅不完整，{n_missed} 幅未到达。请降低帧率，使用更小的区域或更大的数据包，或检查线缆和交换机。</translation>
    </message>
    <message>
        <source>The next image of {place} comes {seconds:.1f} s later. Wait, or replay the images faster.</source>
        <translation>{place} 的下一幅图像还要 {seconds:.1f} s。请等待，或加快回放。</translation>
    </message>
    <message>
        <source>The nominal centre of tip {tip} is not possible: each coordinate is at most {most:g} mm from the origin of the pen frame.</source>
        <translation>测头 {tip} 的标称中心不可能如此：各坐标距光笔坐标系原点最多 {most:g} mm。</translation>
    </message>
    <message>
        <source>The normal of LED {led} points away from the viewer (nz = {nz:.3f}); nz must be positive in the pen frame. Change its sign.</source>
        <translation>LED {led} 的法向量背向观察者 (nz = {nz:.3f})；在光笔坐标系中 nz 必须为正。请改变其符号。</translation>
    </message>
    <message>
        <source>The password has {length} characters, at least {needed} are needed.</source>
        <translation>密码有 {length} 个字符，至少需要 {needed} 个。</translation>
    </message>
    <message>
        <source>The path of the video {path} is no valid UTF-8, which the video decoder needs. Rename the video or its folder, or copy it elsewhere.</source>
        <translation>视频路径 {path} 不是有效的 UTF-8，视频解码器无法使用。请重命名视频或其文件夹，或将其复制到别处。</translation>
    </message>
    <message>
        <source>The pen hardly moved: its postures differ by {found:.1f} degrees (rms), {needed:.0f} degrees are needed. Tilt the pen to all sides, by 20 degrees or more, and turn it about its own axis.</source>
        <translation>光笔几乎没有动：各姿态仅相差 {found:.1f}°（均方根），需要 {needed:.0f}°。请把光笔向各个方向倾斜 20° 以上，并绕自身轴线转动。</translation>
    </message>
    <message>
        <source>The pen is lifted. Put the tip back to go on.</source>
        <translation>光笔已抬起。放回测头即可继续。</translation>
    </message>
    <message>
        <source>The pen is seen in {n} images of the spin; {needed} are needed. Spin it slowly, its LEDs to the camera.</source>
        <translation>旋转的图像中只有 {n} 幅看到光笔；需要 {needed} 幅。请让 LED 朝向相机，慢慢旋转。</translation>
    </message>
    <message>
        <source>The pen leans otherwise than at the touches before, so this one does not count. Hold it as before until the posture is done.</source>
        <translation>光笔的倾斜与前几次接触不同，因此这一次不计入。在该姿态完成之前请保持原来的持法。</translation>
    </message>
    <message>
        <source>The pen was held alike each time: its postures differ by {found:.1f} degrees (rms), {needed:.0f} are needed to prove a tip. Lean it to all sides.</source>
        <translation>光笔每次的握持姿态相同：各姿态仅相差 {found:.1f}°（均方根），验证测头需要 {needed:.0f}°。请向各个方向倾斜。</translation>
    </message>
    <message>
        <source>The pen was held like this before. Lean it another way, and touch the cone five times so.</source>
        <translation>光笔此前已这样持过。请换一个方向倾斜，再接触锥孔五次。</translation>
    </message>
    <message>
        <source>The pen was lifted or moved before the touch was taken, so it does not count. Hold it still until it is.</source>
        <translation>触测取得之前光笔被抬起或移动，因此不计入。请握住不动直到取得。</translation>
    </message>
    <message>
        <source>The pen was swung about one axis only, {axis}: that axis itself turned by {found:.1f} degrees (rms), {needed:.0f} degrees are needed, so the tip&apos;s place along it is not fixed. {advice}</source>
        <translation>光笔只绕一根轴摆动，即{axis}：该轴本身只转动了 {found:.1f}°（均方根），需要 {needed:.0f}°，因此测头沿该轴的位置无法确定。{advice}</translation>
    </message>
    <message>
        <source>The pen was turned by {turn:.0f} degrees about its stylus; at least {needed:.0f} are needed. Keep the tip in the cone and turn it further to both sides.</source>
        <translation>光笔绕测杆只转了 {turn:.0f} 度；至少需要 {needed:.0f} 度。请保持测头在锥孔中，向两侧再多转一些。</translation>
    </message>
    <message>
        <source>The point moves as the pen leans, by {deviation:.4f} mm along {axis} (limit {limit:.4f} mm): the tip sits {x:+.4f} {y:+.4f} {z:+.4f} mm from where it was calibrated. Was it exchanged, bent or screwed in anew, or is it the tip of another pen?</source>
        <translation>该点随光笔倾斜而移动，沿 {axis} 为 {deviation:.4f} mm（限值 {limit:.4f} mm）：测头偏离标定位置 {x:+.4f} {y:+.4f} {z:+.4f} mm。测头是否被更换、碰弯或重新拧过，或者是另一支光笔的测头？</translation>
    </message>
    <message>
        <source>The point scatters by {deviation:.4f} mm along {axis} (standard deviation, limit {limit:.4f} mm), which no other tip would mend. The tip may not rest in the cone: look for dirt, wear and a loose cone.</source>
        <translation>该点沿 {axis} 的散布为 {deviation:.4f} mm（标准差，限值 {limit:.4f} mm），换用其他测头位置也不能消除。测头可能没有停稳在锥孔中：请检查污物、磨损和锥孔是否松动。</translation>
    </message>
    <message>
        <source>The point stays within a sphere of {error:.4f} mm as the pen leans (limit {limit:.4f} mm).</source>
        <translation>光笔倾斜时，该点保持在直径 {error:.4f} mm 的球内（限值 {limit:.4f} mm）。</translation>
    </message>
    <message>
        <source>The point stays within {u:.4f} {v:.4f} {w:.4f} mm (standard deviation along u v w) however the pen is held.</source>
        <translation>无论光笔如何握持，该点保持在 {u:.4f} {v:.4f} {w:.4f} mm 以内（沿 u v w 的标准差）。</translation>
    </message>
    <message>
        <source>The point wanders within a sphere of {error:.4f} mm as the pen leans (limit {limit:.4f} mm).</source>
        <translation>光笔倾斜时，该点在直径 {error:.4f} mm 的球内游移（限值 {limit:.4f} mm）。</translation>
    </message>
    <message>
        <source>The points lie {rms:.2f} px from where a flat board {board} has them: it has other squares than said, is bent, or the images are not of one camera with one focus. Count and measure its squares again.</source>
        <translation>各点与平整标定板 {board} 的应有位置相差 {rms:.2f} px：格子与所指定的不符、板面弯曲，或图像不是同一相机在同一对焦下拍摄。请重新数并测量格子。</translation>
    </message>
    <message>
        <source>The poses are of two tips, {distance:.2f} mm apart in the pen, as if the tip had been exchanged or had slipped in its holder. One: poses {first}. The other: poses {second}. {consequence}</source>
        <translation>这些位姿属于两个测头，在光笔上相距 {distance:.2f} mm，似乎测头被更换过，或在夹持处松动移位。一组：位姿 {first}。另一组：位姿 {second}。{consequence}</translation>
    </message>
    <message>
        <source>The poses have no tip in common: the best one scatters by {scatter:.0f} mm, while the poses themselves are {movement:.0f} mm apart. Check that they are of one pen that was swung on its tip, as cam_from_pen, and that rotations and translations belong together.</source>
        <translation>这些位姿没有共同的测头：最佳结果的散布为 {scatter:.0f} mm，而位姿本身彼此相距 {movement:.0f} mm。请检查：位姿是否来自同一支绕测头摆动的光笔，是否以 cam_from_pen 给出，旋转与平移是否对应。</translation>
    </message>
    <message>
        <source>The postures differ by {found:.1f} degrees (rms), {needed:.0f} are needed. Hold the pen upright, and lean it to four sides.</source>
        <translation>各姿态仅相差 {found:.1f}°（均方根），需要 {needed:.0f}°。请将光笔竖直握持，并向四个方向倾斜。</translation>
    </message>
    <message>
        <source>The program failed on this image ({kind}: {problem}). Keep the image, and report it.</source>
        <translation>程序处理该图像时出错（{kind}: {problem}）。请保留该图像并反馈此问题。</translation>
    </message>
    <message>
        <source>The program made a mistake of its own and looks at no more images. Open the camera again.</source>
        <translation>程序自身出错，不再查看图像。请重新打开相机。</translation>
    </message>
    <message>
        <source>The program made a mistake of its own, and the verification is paused. What was found so far is kept; go on, or start it over.</source>
        <translation>程序自身出错，验证已暂停。已得到的结果保留；请继续，或重新开始。</translation>
    </message>
    <message>
        <source>The program made a mistake of its own. The images kept so far are safe; go on, or start the program again.</source>
        <translation>程序自身出错。已保留的图像是安全的；请继续，或重新启动程序。</translation>
    </message>
    <message>
        <source>The radius is off by {error:+.4f} mm (U {uncertainty:.4f} mm, limit {limit:.4f} mm).</source>
        <translation>半径偏差 {error:+.4f} mm（U {uncertainty:.4f} mm，限值 {limit:.4f} mm）。</translation>
    </message>
    <message>
        <source>The radius is off by {error:+.4f} mm (U {uncertainty:.4f} mm, limit {limit:.4f} mm). Tip, LED file or camera file may be wrong, or the ball is not compensated.</source>
        <translation>半径偏差 {error:+.4f} mm（U {uncertainty:.4f} mm，限值 {limit:.4f} mm）。测头、LED 文件或内参文件可能有误，或未补偿测球半径。</translation>
    </message>
    <message>
        <source>The radius of the ring is not known. Enter the certified one.</source>
        <translation>圆环半径未知。请输入证书半径。</translation>
    </message>
    <message>
        <source>The record of {entry} is missing.</source>
        <translation>{entry}的标定数据缺失。</translation>
    </message>
    <message>
        <source>The record {name} holds no images. Resume the swing, or begin a new one.</source>
        <translation>记录 {name} 中没有图像。请继续该摆动，或开始新的摆动。</translation>
    </message>
    <message>
        <source>The record {record} of {entries} was changed in the archive.</source>
        <translation>{entries}的标定数据 {record} 在档案库中被改动过。</translation>
    </message>
    <message>
        <source>The recorded images are {found}, not {wanted}. Choose {found}.</source>
        <translation>录制的图像为 {found}，而不是 {wanted}。请选择 {found}。</translation>
    </message>
    <message>
        <source>The recording of the second camera holds another number of images than that of the first. Choose two recordings of the same moments.</source>
        <translation>第二台相机的录像与第一台的图像数量不同。请选择同一时刻的两组录像。</translation>
    </message>
    <message>
        <source>The residuals are large: {sigma:.2f} px, {usual} px or less is usual. Check that the camera file is of this camera, lens and focus, and the pen file of this pen.</source>
        <translation>残差过大：{sigma:.2f} px，通常不超过 {usual} px。请检查内参文件是否属于此相机、镜头和对焦，LED 文件是否属于此光笔。</translation>
    </message>
    <message>
        <source>The result {file} is not the one that was entered in the archive: it was changed since. Restore it from a copy.</source>
        <translation>结果 {file} 与档案中登记的不一致：登记之后被更改过。请从备份恢复。</translation>
    </message>
    <message>
        <source>The rig file has camera {camera} {angle:.1f} degrees and {distance:.0f} mm away from where the images put it.</source>
        <translation>相机组文件中相机 {camera} 的位置与图像所示相差 {angle:.1f} 度和 {distance:.0f} mm。</translation>
    </message>
    <message>
        <source>The seal {file} of the archive was changed or damaged.</source>
        <translation>档案库的封印文件 {file} 被改动过或已损坏。</translation>
    </message>
    <message>
        <source>The supervisor&apos;s password is another one. Type it again.</source>
        <translation>主管密码不符。请重新输入。</translation>
    </message>
    <message>
        <source>The swing of the result {file} is not in {folder}. Copy it back there, then open the result again.</source>
        <translation>标定结果 {file} 对应的摆动记录不在 {folder} 中。请将其复制回该处，然后重新打开该结果。</translation>
    </message>
    <message>
        <source>The swing {folder} of entry {number} is missing.</source>
        <translation>第 {number} 个条目的摆动 {folder} 缺失。</translation>
    </message>
    <message>
        <source>The swing {swing}, which was held out, does not confirm the new LED file: it leaves {after:.4f} px, the old one {before:.4f} px. The old file is as good, or the pen changed in between.</source>
        <translation>未参与合并的摆动 {swing} 不支持新的 LED 文件：新文件的残差为 {after:.4f} px，旧文件为 {before:.4f} px。旧文件同样好，或光笔在此期间有变化。</translation>
    </message>
    <message>
        <source>The tip cannot be accepted. {why}</source>
        <translation>不能接受该测头。{why}</translation>
    </message>
    <message>
        <source>The tip cannot be compared with the one in force. {why}</source>
        <translation>无法与已生效的测头比较。{why}</translation>
    </message>
    <message>
        <source>The tip did not keep the limits. {why} Only a supervisor can accept it, with a reason.</source>
        <translation>测头未满足限值。{why}只有主管说明理由后才能接受。</translation>
    </message>
    <message>
        <source>The tip did not stay in one place: it moved by {scatter:.2f} mm (rms), {excess:.0f} times what the images alone explain. Press the tip into the cone and repeat; check that cone and camera are clamped, and that the intrinsics file is of this camera, lens and focus.</source>
        <translation>测头没有停在原处：移动了 {scatter:.2f} mm（均方根），是图像本身所能解释的 {excess:.0f} 倍。请把测头压入锥孔后重做；检查锥孔和相机是否夹紧，以及内参文件属于该相机、镜头和对焦设置。</translation>
    </message>
    <message>
        <source>The tip in {tip} was calibrated with the pen file {its_pen}, which {pen} is not: a tip belongs to the pen, and to the LED positions, that it was calibrated with. Give that file, or calibrate the tip with this one.</source>
        <translation>{tip} 中的测头是用 LED 文件 {its_pen} 标定的，而 {pen} 不是该文件：测头属于标定时所用的光笔和 LED 位置。请给出该文件，或用此文件标定测头。</translation>
    </message>
    <message>
        <source>The tip is being computed. Keep the pen at hand.</source>
        <translation>正在计算测头。请把光笔放在手边。</translation>
    </message>
    <message>
        <source>The tip is beyond the limit of this station. {why} Only a supervisor can accept it, with a reason.</source>
        <translation>测头超出本工位的限值。{why}只有主管说明理由后才能接受。</translation>
    </message>
    <message>
        <source>The tip is to be checked. {why} Accept it with a reason, or not at all.</source>
        <translation>该测头需检查。{why}请注明理由后接受，否则不要接受。</translation>
    </message>
    <message>
        <source>The tip library is not as it was laid down: {file} was changed or damaged since. Restore the file from a copy.</source>
        <translation>测头库与当初保存的不一致：{file} 此后被更改或损坏。请从副本恢复该文件。</translation>
    </message>
    <message>
        <source>The tip lies {distance:.1f} mm from its nominal place. Is it the tip that is named?</source>
        <translation>测头偏离标称位置 {distance:.1f} mm。是否为所填写的测头？</translation>
    </message>
    <message>
        <source>The tip lies {distance:.4f} mm from that of {date}: along {axis} {difference:.4f} mm, where U (k = 2) of both explains {uncertainty:.4f} mm. Was it exchanged, bent, or mounted anew?</source>
        <translation>测头与 {date} 的结果相差 {distance:.4f} mm：沿 {axis} 方向相差 {difference:.4f} mm，而两者的 U (k = 2) 只能解释 {uncertainty:.4f} mm。测头是否更换、弯曲或重新安装过？</translation>
    </message>
    <message>
        <source>The tip lies {distance:.4f} mm from that of {date}; its limit is {limit:.4f} mm. Was it exchanged, bent, or mounted anew?</source>
        <translation>测头与 {date} 的位置相距 {distance:.4f} mm；其限值为 {limit:.4f} mm。是否更换过、弯曲过或重新安装过？</translation>
    </message>
    <message>
        <source>The tip repeats within {deviation:.4f} mm along {axis} (standard deviation, limit {limit:.4f} mm); its calibrations state {stated:.4f} mm.</source>
        <translation>测头沿 {axis} 的重复性为 {deviation:.4f} mm（标准差，限值 {limit:.4f} mm）；各次标定给出 {stated:.4f} mm。</translation>
    </message>
    <message>
        <source>The tip scatters by {deviation:.4f} mm along {axis} (standard deviation, limit {limit:.4f} mm); its calibrations state {stated:.4f} mm. Touch a fixed point several times: whether that scatters alike tells what moved.</source>
        <translation>测头沿 {axis} 的散布为 {deviation:.4f} mm（标准差，限值 {limit:.4f} mm）；各次标定给出 {stated:.4f} mm。请多次触测一个固定点：它是否同样散布可说明是什么在移动。</translation>
    </message>
    <message>
        <source>The tip scatters by {of_tip:.4f} mm over the calibrations, a fixed point touched with it by only {of_point:.4f} mm. An error of the calibration would move both alike: so something moved with the pen between the calibrations. Look for a tip that is not screwed in firmly, a loose or knocked LED, or LEDs that were measured too coarsely.</source>
        <translation>各次标定的测头散布为 {of_tip:.4f} mm，而用它触测的固定点仅散布 {of_point:.4f} mm。标定误差会使二者同样变化：因此两次标定之间光笔上有东西移动。请检查测头是否拧紧、LED 是否松动或被碰，或 LED 是否测量得太粗。</translation>
    </message>
    <message>
        <source>The tip {tip} is retired and cannot be put in force. Bring it back in the tip library, or calibrate another one.</source>
        <translation>测头 {tip} 已停用，不能生效。请在测头库中恢复使用，或标定另一个测头。</translation>
    </message>
    <message>
        <source>The touches lie in one place or on a line, which is no circle. Touch the ring all round.</source>
        <translation>各触测点位于同一处或一条直线上，不成圆。请沿环一周触测。</translation>
    </message>
    <message>
        <source>The touches lie on a circle of radius {measured:.3f} mm, {certified} mm is certified. Is it this ring, and its radius rather than its diameter?</source>
        <translation>触测点所在圆的半径为 {measured:.3f} mm，证书值为 {certified} mm。是这个环吗？给出的是半径而不是直径吗？</translation>
    </message>
    <message>
        <source>The touches of {run} cover {covered:.0f} degrees of the ring, at least {needed:.0f} are needed: a radius from less is hardly worth anything. Touch the ring also in the gap between {first} and {second}.</source>
        <translation>{run} 的触测覆盖环的 {covered:.0f}°，至少需要 {needed:.0f}°：更少时求得的半径几乎没有意义。请在 {first} 与 {second} 之间的空缺处也触测。</translation>
    </message>
    <message>
        <source>The touches of {run} lie at more than two places: {touch} is {distance:.2f} mm from the others of its end. Was the pen lifted there? Touch nothing but the two ends.</source>
        <translation>{run} 的触测点不止两处：{touch} 与同一端的其他点相距 {distance:.2f} mm。光笔是否在该处抬起？请只触测两端。</translation>
    </message>
    <message>
        <source>The touches of {run} lie on no circle: {n_off} of {n_touches} are off it, and the others by up to {off:.2f} mm. Touch one ring, in one plane.</source>
        <translation>{run} 的触测点不在一个圆上：{n_touches} 个点中有 {n_off} 个偏离，其余最多偏离 {off:.2f} mm。请在一个平面内触测同一个环。</translation>
    </message>
    <message>
        <source>The touches of {run} lie up to {form:.4f} mm off a circle in a plane (limit {limit:.4f} mm): the tip slipped, the ring is dirty, or the tip is off.</source>
        <translation>{run} 的触测点最多偏离平面圆 {form:.4f} mm（限值 {limit:.4f} mm）：测头滑动，环不清洁，或测头有误。</translation>
    </message>
    <message>
        <source>The two touches lie {distance:.2f} mm apart, {certified} mm is certified: they are not of its two ends. Touch the end opposite to the last touch.</source>
        <translation>两次触测相距 {distance:.2f} mm，证书长度为 {certified} mm：它们不是该长度的两端。请触测与上一次触测相对的一端。</translation>
    </message>
    <message>
        <source>The verification in {file} is not as it was written: it was changed or damaged since. Restore the file from a copy.</source>
        <translation>{file} 中的验证与写入时不同：之后被更改或损坏。请从副本恢复该文件。</translation>
    </message>
    <message>
        <source>The verification is done. Put the pen down.</source>
        <translation>验证已完成。可以放下光笔。</translation>
    </message>
    <message>
        <source>The views are too alike: the board is tilted by {apart:.0f} degrees from view to view at most, and the focal length is known to {share:.1%} only. Add views with the board tilted by 20 to 40 degrees to each side, and reaching into each corner of the image.</source>
        <translation>视图过于相似：各视图间标定板的倾斜最多相差 {apart:.0f} 度，焦距只能确定到 {share:.1%}。请补充标定板向各侧倾斜 20 至 40 度并伸入图像各角的视图。</translation>
    </message>
    <message>
        <source>The views do not agree on where the second camera stands: {n_agree} of {n_pairs} do. Either a camera was moved meanwhile, or the images that are taken for one moment are not. Check their names and order.</source>
        <translation>各视图给出的第二台相机位置不一致：{n_pairs} 组中只有 {n_agree} 组一致。可能期间移动了某台相机，或配成一组的图像不是同一时刻。请检查图像的名称和顺序。</translation>
    </message>
    <message>
        <source>The views do not reach the corners of the image, and the distortion that they tell would fold it there. {coefficients} is drawn towards 0, just so far that it does not: the corners are a guess. Add views with the board in each of them, or keep the pen out of them.</source>
        <translation>视图未覆盖图像四角,由其得出的畸变会使图像在那里折叠。已将 {coefficients} 拉向 0,恰好使其不折叠:四角处只是推测。请补充标定板位于各角的视图,或不要让光笔进入四角。</translation>
    </message>
    <message>
        <source>The views leave the camera open: they are too alike. Add views with the board tilted by 20 to 40 degrees to each side, and reaching into each corner of the image.</source>
        <translation>这些视图无法确定相机：它们过于相似。请补充标定板向各侧倾斜 20 至 40 度并伸入图像各角的视图。</translation>
    </message>
    <message>
        <source>The witness moved by {distance:.4f} mm between {first} and {visit} (U {uncertainty:.4f} mm, limit {limit:.4f} mm): the camera or the witness is not clamped, or the camera was not warm yet. What was measured in between is off by as much.</source>
        <translation>监视点在 {first} 与 {visit} 之间移动了 {distance:.4f} mm（U {uncertainty:.4f} mm，限值 {limit:.4f} mm）：相机或监视点没有夹紧，或相机尚未预热。其间的测量结果也有同样的偏差。</translation>
    </message>
    <message>
        <source>The witness stays within {distance:.4f} mm (U {uncertainty:.4f} mm, limit {limit:.4f} mm).</source>
        <translation>监视点的移动在 {distance:.4f} mm 以内（U {uncertainty:.4f} mm，限值 {limit:.4f} mm）。</translation>
    </message>
    <message>
        <source>The witness was visited once, which tells nothing of a drift. Touch it before, during and after the session.</source>
        <translation>监视点只触测了一次，看不出漂移。请在工作之前、期间和之后各触测一次。</translation>
    </message>
    <message>
        <source>The {kind} {id} is in the library already, retired. Bring it back, or give this one another id.</source>
        <translation>测头库中已有{kind} {id}，但已停用。请恢复使用，或为这一个另取编号。</translation>
    </message>
    <message>
        <source>The {kind} {id} is in the library already. Change that one, or give this one another id.</source>
        <translation>测头库中已有{kind} {id}。请更改那一个，或为这一个另取编号。</translation>
    </message>
    <message>
        <source>The {kind} {id} was to be used until {due} only. Have it looked after.</source>
        <translation>{kind} {id} 只可用至 {due}。请安排检查。</translation>
    </message>
    <message>
        <source>The {what} of this camera cannot be set. Use the aperture of the lens.</source>
        <translation>此相机的{what}无法设定。请使用镜头光圈。</translation>
    </message>
    <message>
        <source>The {what} {path} has a name that no file can have. Check the name.</source>
        <translation>{what} {path} 的名称不可能是文件名。请检查名称。</translation>
    </message>
    <message>
        <source>There are entries of the chain {chain}, which the archive does not know.</source>
        <translation>存在链 {chain} 的条目，但档案库中没有这条链。</translation>
    </message>
    <message>
        <source>There are {n_few} images of {few} and {n_many} of {many}, and their names, such as {example} and {other}, do not tell which are of the same moment. Give the images of one moment the same name or number.</source>
        <translation>{few} 有 {n_few} 幅图像，{many} 有 {n_many} 幅，而它们的名称（例如 {example} 和 {other}）不能表明哪些属于同一时刻。请让同一时刻的图像具有相同的名称或编号。</translation>
    </message>
    <message>
        <source>There are {n_postures} postures, {needed} are needed: upright, and leant to four sides.</source>
        <translation>共有 {n_postures} 个姿态，需要 {needed} 个：竖直，以及向四个方向倾斜。</translation>
    </message>
    <message>
        <source>There is a file {file} already. Give the export another name.</source>
        <translation>文件 {file} 已存在。请为导出文件另取名称。</translation>
    </message>
    <message>
        <source>There is no camera {place}{why}. Check its power, its cable and its address, then search again.</source>
        <translation>没有相机 {place}{why}。请检查电源、线缆和地址，然后重新搜索。</translation>
    </message>
    <message>
        <source>There is no {kind} {id} in the library. Add it first.</source>
        <translation>测头库中没有{kind} {id}。请先添加。</translation>
    </message>
    <message>
        <source>This end was touched before. Touch the other one.</source>
        <translation>这一端已触测过。请触测另一端。</translation>
    </message>
    <message>
        <source>This place of the ring was touched before. Touch it where it was not.</source>
        <translation>圆环的这一处已触测过。请触测未触测过的地方。</translation>
    </message>
    <message>
        <source>This posture was taken before. Leave the tip in the cone and lean the pen another way.</source>
        <translation>这一姿态已取得。请把测头留在锥孔里，让光笔倒向另一个方向。</translation>
    </message>
    <message>
        <source>This result of tip {tip}, pen {pen}, is not the one in force any more. Look at which one is before you take it back.</source>
        <translation>测头 {tip}、光笔 {pen} 的这一结果已不再生效。撤回之前，请先查看现在生效的是哪一个。</translation>
    </message>
    <message>
        <source>Too many levels of symbolic links</source>
        <translation>符号链接的层数过多</translation>
    </message>
    <message>
        <source>Too many open files</source>
        <translation>打开的文件过多</translation>
    </message>
    <message>
        <source>Touch one end of the length, then the other, and hold still on each: {n_touches} of 2.</source>
        <translation>先触测长度的一端，再触测另一端，各保持不动：{n_touches} / 2。</translation>
    </message>
    <message>
        <source>Touch the cone {needed} times in one posture and lift the tip in between: {n_touches} of {needed}. Posture {posture} of {n_postures}: upright, and leant to four sides.</source>
        <translation>以同一姿态接触锥孔 {needed} 次，每次之间抬起测头：{n_touches} / {needed}。第 {posture} 个姿态，共 {n_postures} 个：竖直，以及向四个方向倾斜。</translation>
    </message>
    <message>
        <source>Touch the ring all round and hold still on each point: {covered:.0f} of {needed:.0f} degrees by {n_touches} touches.</source>
        <translation>沿环一周触测，在每个点上保持不动：{n_touches} 次触测，{covered:.0f}° / {needed:.0f}°。</translation>
    </message>
    <message>
        <source>U (k = 2) cannot get below {floor:.1f} µm with this LED file; the limit is {limit:.1f} µm. No more images are asked for than the postures need.</source>
        <translation>使用此 LED 文件，U (k = 2) 无法低于 {floor:.1f} µm；限值为 {limit:.1f} µm。除各姿态所需的图像外，不再要求更多图像。</translation>
    </message>
    <message>
        <source>U (k = 2) of the length at {run} is {uncertainty:.4f} mm, more than the limit of {limit:.4f} mm: this does not prove the tip. Touch each end more often, and lay the length across the view.</source>
        <translation>{run} 处长度的 U (k = 2) 为 {uncertainty:.4f} mm，大于限值 {limit:.4f} mm：不足以验证测头。请对每端多次触测，并使长度方向横对视线。</translation>
    </message>
    <message>
        <source>U (k = 2) of the radius is {uncertainty:.4f} mm, more than the limit of {limit:.4f} mm: this does not prove the tip.</source>
        <translation>半径的 U (k = 2) 为 {uncertainty:.4f} mm，大于限值 {limit:.4f} mm：不足以验证测头。</translation>
    </message>
    <message>
        <source>U (k = 2) of the tip along its weakest direction is compared with the limit of {limit:.4f} mm by simple acceptance (ILAC-G8:09/2019, 4.2.1; JCGM 106:2012, 8.2): what is judged is U itself, so the guard band is zero. U up to the limit is PASS, above it CHECK, above {far:.4f} mm, {times:g} times the limit, REPEAT.</source>
        <translation>测头沿最弱方向的 U (k = 2) 按简单接受准则（ILAC-G8:09/2019 第 4.2.1 条；JCGM 106:2012 第 8.2 条）与限值 {limit:.4f} mm 比较：被判定的量就是 U 本身，故保护带为零。U 不超过限值判为“合格”，超过限值判为“需检查”，超过 {far:.4f} mm（限值的 {times:g} 倍）判为“重做”。</translation>
    </message>
    <message>
        <source>Webcam, to try it</source>
        <translation>网络摄像头（试用）</translation>
    </message>
    <message>
        <source>ball and cone, which are not quite round. Use better ones, and state their form error</source>
        <translation>测球与锥孔不够圆。请换用更好的，并给出其形状误差</translation>
    </message>
    <message>
        <source>bottom left</source>
        <translation>左下</translation>
    </message>
    <message>
        <source>bottom right</source>
        <translation>右下</translation>
    </message>
    <message>
        <source>calibration</source>
        <translation>标定结果</translation>
    </message>
    <message>
        <source>camera {number} of {name}</source>
        <translation>{name} 中的第 {number} 台相机</translation>
    </message>
    <message>
        <source>cameras in {name} is no list of 2 to {most} cameras. One camera alone needs no rig file.</source>
        <translation>{name} 中的 cameras 不是 2 至 {most} 台相机的列表。单台相机不需要相机组文件。</translation>
    </message>
    <message>
        <source>centimetres</source>
        <translation>厘米</translation>
    </message>
    <message>
        <source>diameter of the discs</source>
        <translation>发光面的直径</translation>
    </message>
    <message>
        <source>downwards</source>
        <translation>向下</translation>
    </message>
    <message>
        <source>entry {number} of the chain {chain}</source>
        <translation>链 {chain} 的第 {number} 个条目</translation>
    </message>
    <message>
        <source>exported archive</source>
        <translation>导出的档案库</translation>
    </message>
    <message>
        <source>file</source>
        <translation>文件</translation>
    </message>
    <message>
        <source>file of limits</source>
        <translation>限值文件</translation>
    </message>
    <message>
        <source>further turn of cam_from_rig about {axis}</source>
        <translation>cam_from_rig 绕 {axis} 轴的附加转角</translation>
    </message>
    <message>
        <source>inches</source>
        <translation>英寸</translation>
    </message>
    <message>
        <source>measured drift of the camera</source>
        <translation>相机漂移测量记录</translation>
    </message>
    <message>
        <source>metres</source>
        <translation>米</translation>
    </message>
    <message>
        <source>micrometres</source>
        <translation>微米</translation>
    </message>
    <message>
        <source>no entry</source>
        <translation>无对应条目</translation>
    </message>
    <message>
        <source>no image</source>
        <translation>无图像</translation>
    </message>
    <message>
        <source>not of the same moment</source>
        <translation>不是同一时刻</translation>
    </message>
    <message>
        <source>pypylon is not installed. It drives Basler cameras: {python} -m pip install pypylon</source>
        <translation>未安装 pypylon。它驱动 Basler 相机：{python} -m pip install pypylon</translation>
    </message>
    <message>
        <source>pypylon is not part of this program. Basler cameras also work as GenICam cameras, with the GenTL producer of pylon.</source>
        <translation>本程序不包含 pypylon。Basler 相机也可借助 pylon 的 GenTL 生产者作为 GenICam 相机使用。</translation>
    </message>
    <message>
        <source>rig file</source>
        <translation>相机组文件</translation>
    </message>
    <message>
        <source>scale of the LEDs</source>
        <translation>LED 坐标的尺度</translation>
    </message>
    <message>
        <source>seal</source>
        <translation>封印文件</translation>
    </message>
    <message>
        <source>the diameter of the LED discs. State it and its uncertainty in the LED file</source>
        <translation>LED 发光面的直径。请在 LED 文件中给出直径及其不确定度</translation>
    </message>
    <message>
        <source>there is no such port</source>
        <translation>没有这样的端口</translation>
    </message>
    <message>
        <source>top left</source>
        <translation>左上</translation>
    </message>
    <message>
        <source>top right</source>
        <translation>右上</translation>
    </message>
    <message>
        <source>upwards</source>
        <translation>向上</translation>
    </message>
    <message>
        <source>verified fixed point</source>
        <translation>固定点验证记录</translation>
    </message>
    <message>
        <source>verified length</source>
        <translation>长度验证记录</translation>
    </message>
    <message>
        <source>{file} is no exported archive, or not as it was exported: line {line}. Export it again, with this version of the program.</source>
        <translation>{file} 不是导出的档案库，或与导出时不符：第 {line} 行。请用此版本的程序重新导出。</translation>
    </message>
    <message>
        <source>{name} has the calibration_temperature {celsius:g}; degrees Celsius from {coldest:g} to {warmest:g} are needed. Correct or remove it.</source>
        <translation>{name} 中 calibration_temperature 为 {celsius:g}；应为 {coldest:g} 至 {warmest:g} 摄氏度。请更正或删除。</translation>
    </message>
    <message>
        <source>{name} has {width} x {height} px, {first} has {first_width} x {first_height} px. Give images of one camera, with one region and binning.</source>
        <translation>{name} 为 {width} x {height} px，{first} 为 {first_width} x {first_height} px。请提供同一相机、相同区域和像素合并设置的图像。</translation>
    </message>
    <message>
        <source>{name} holds the tables of another program, and stays as it is. Give the archive a database of its own.</source>
        <translation>{name} 中有其他程序的表，现保持原样。请为档案库使用单独的数据库。</translation>
    </message>
    <message>
        <source>{name} is of {n_cameras} cameras, and {n_files} files of cameras are beside it. Restore it from a copy.</source>
        <translation>{name} 对应 {n_cameras} 台相机，而与之相配的内参文件有 {n_files} 个。请从备份恢复该文件。</translation>
    </message>
    <message>
        <source>{name} is {width} x {height} px, the other images are {usual_width} x {usual_height} px. Replay only images of one camera together.</source>
        <translation>{name} 为 {width} × {height} px，其他图像为 {usual_width} × {usual_height} px。请只回放同一台相机的图像。</translation>
    </message>
    <message>
        <source>{path} cannot be written: {reason} The images recorded so far are safe.</source>
        <translation>无法写入 {path}：{reason}已记录的图像是安全的。</translation>
    </message>
    <message>
        <source>{path} does not hold all that is put on paper: it is no calibration, or one by an earlier version of the program. Give an accepted result or what the command calibrate wrote, or calibrate again from the images.</source>
        <translation>{path} 不包含纸质记录所需的全部内容：它不是标定结果，或由程序的早期版本生成。请给出已接受的结果或 calibrate 命令写出的文件，或用图像重新标定。</translation>
    </message>
    <message>
        <source>{path} is neither a recorded swing nor a result. Open the folder of a swing, a file in it, or a file in the folder results.</source>
        <translation>{path} 既不是摆动记录，也不是标定结果。请打开摆动记录的文件夹、其中的文件，或 results 文件夹中的文件。</translation>
    </message>
    <message>
        <source>{path} is no {what}, or was changed since it was written. Give the JSON as it was written.</source>
        <translation>{path} 不是{what}，或写出后被更改。请给出写出时的 JSON 文件。</translation>
    </message>
    <message>
        <source>{run}: the pen was held still nowhere for {n_all} images, {n_settling} to settle and {n_frames} that count. Hold it still longer on each point, ask for fewer images of a touch, or take each image for a touch.</source>
        <translation>{run}：光笔没有在任何位置静止保持 {n_all} 幅图像（{n_settling} 幅用于稳定，{n_frames} 幅计入）。请在每个点上保持静止更久，减少每次触测的图像数，或将每幅图像作为一次触测。</translation>
    </message>
    <message>
        <source>The residuals are {sigma:.2f} px, {usual:.2f} px or less is usual. Is this the LED file of this pen, and the intrinsics file of this camera and lens?</source>
        <translation>残差为 {sigma:.2f} px，通常不超过 {usual:.2f} px。LED 文件是否属于本光笔，内参文件是否属于这台相机和镜头？</translation>
    </message>
    <message>
        <source>&apos;{id}&apos; is no id. Give up to {most} letters and digits, as its label has them.</source>
        <translation>“{id}”不是编号。请按标签输入最多 {most} 个字母和数字。</translation>
    </message>
    <message>
        <source>0 0 0 is no direction. Give the axis of the stylus from the ball into the pen, in the frame of the pen, such as 0 1 0.</source>
        <translation>0 0 0 不是方向。请给出测杆轴线在光笔坐标系中由测球指向光笔的方向，例如 0 1 0。</translation>
    </message>
    <message>
        <source>A ball of {diameter:g} mm is not possible: above 0 and up to {most:g} mm are. Measure it, or leave it out where it is not known.</source>
        <translation>测球直径不可能是 {diameter:g} mm：须大于 0 且不超过 {most:g} mm。请测量；若未知则留空。</translation>
    </message>
    <message>
        <source>A fixed point scatters by {of_point:.4f} mm, the tip by only {of_tip:.4f} mm over the calibrations. The tip is steady: the cone or the camera moved between the touches, or the tip did not rest in the cone.</source>
        <translation>固定点的散布为 {of_point:.4f} mm，而各次标定间测头的散布仅 {of_tip:.4f} mm。测头是稳定的：触测之间锥孔或相机移动过，或测头未落稳在锥孔中。</translation>
    </message>
    <message>
        <source>A limit of {limit:g} mm for the change is not possible: above 0 and up to {most:g} mm are.</source>
        <translation>变化限值不可能是 {limit:g} mm：须大于 0 且不超过 {most:g} mm。</translation>
    </message>
    <message>
        <source>A touch {distance:.1f} mm from the others does not count: the tip was not in the cone. Put it into the cone and hold it still.</source>
        <translation>与其他各点相距 {distance:.1f} mm 的一次接触不计入：测头不在锥孔中。请把测头放入锥孔并保持不动。</translation>
    </message>
    <message>
        <source>All LEDs changed by one scale, {growth:+.0f} ppm: the pen is {kelvin:+.1f} K warmer (of aluminium), or cone and camera moved apart along the view. No single LED has moved.</source>
        <translation>所有 LED 按同一比例变化（{growth:+.0f} ppm）：光笔温度变化 {kelvin:+.1f} K（按铝计），或锥孔与相机沿视线方向相互远离。没有单个 LED 移位。</translation>
    </message>
    <message>
        <source>Camera {camera} shows the pen in another posture than the other cameras at {n_apart} of {n_moments} moments, such as {example}; its images of these are left out. Check that the images of one moment have the same name, and the trigger.</source>
        <translation>相机 {camera} 在 {n_moments} 个时刻中的 {n_apart} 个所显示的光笔姿态与其他相机不同，例如 {example}；这些时刻的该相机图像不参与计算。请检查同一时刻的图像是否同名，并检查触发信号。</translation>
    </message>
    <message>
        <source>Next: go on with this pen and its LED file.</source>
        <translation>下一步：继续使用此光笔及其 LED 文件。</translation>
    </message>
    <message>
        <source>Next: let the pen take the temperature of the room, and measure a certified length.</source>
        <translation>下一步：让光笔达到室温，并测量一段已认证的长度。</translation>
    </message>
    <message>
        <source>Next: tighten the tip, look at the LEDs of the pen, calibrate it again, and verify the new result.</source>
        <translation>下一步：拧紧测头，检查光笔的 LED，重新标定，并验证新的结果。</translation>
    </message>
    <message>
        <source>Next: use the tip of the newest calibration.</source>
        <translation>下一步：使用最近一次标定的测头。</translation>
    </message>
    <message>
        <source>Next: use what was touched between the visits.</source>
        <translation>下一步：使用各次复测之间触测的结果。</translation>
    </message>
    <message>
        <source>The address of the archive&apos;s server cannot be read. It has the form postgresql://user:password@host/database, with %40 for an @ in the password.</source>
        <translation>无法读取档案服务器的地址。其格式为 postgresql://user:password@host/database，口令中的 @ 写作 %40。</translation>
    </message>
    <message>
        <source>The adjustment did not settle in {n_steps} steps: the views are too alike, or of another board than was said. Add views with the board tilted by 20 to 40 degrees to each side, and reaching into each corner of the image; if there are some, count and measure its squares again.</source>
        <translation>平差在 {n_steps} 步内未收敛:视图过于相似,或标定板与所述不符。请补充标定板向各侧倾斜 20 至 40 度、并到达图像各角的视图;若已有这样的视图,请重新清点并测量其方格。</translation>
    </message>
    <message>
        <source>The archive {name} is held by another program, for more than {seconds} s now. Let that one finish, or end it, and try again.</source>
        <translation>档案 {name} 被另一程序占用已超过 {seconds} s。请等该程序完成或将其结束，然后重试。</translation>
    </message>
    <message>
        <source>The axis of the stylus is uncertain by {uncertainty:.1f} degrees, at most {needed:.1f} are of use: the pen was tilted while it was spun. Hold the stylus upright between two fingers and turn only.</source>
        <translation>测杆轴线的不确定度为 {uncertainty:.1f} 度，最多 {needed:.1f} 度才可用：旋转时光笔发生了倾斜。请用两指扶直测杆，只转动。</translation>
    </message>
    <message>
        <source>The calibration of a camera in {file} is not as it was written: it was changed or damaged since. Restore the file from a copy.</source>
        <translation>{file} 中的相机标定与写入时不同：之后被更改或损坏。请从副本恢复该文件。</translation>
    </message>
    <message>
        <source>The diameter of the ball is not known, which a ring or a length touched at its faces needs. Enter it where the tip is named.</source>
        <translation>测球直径未知，而触测圆环或长度的表面时需要它。请在命名测头处输入。</translation>
    </message>
    <message>
        <source>The folder {folder} cannot be made or read: {reason}</source>
        <translation>文件夹 {folder} 无法创建或读取：{reason}</translation>
    </message>
    <message>
        <source>The folder {folder} is not empty: it holds {example}. Choose another, or empty it; nothing is overwritten.</source>
        <translation>文件夹 {folder} 不是空的：其中有 {example}。请选择其他文件夹，或将其清空；不会覆盖任何内容。</translation>
    </message>
    <message>
        <source>The pen leans otherwise than at the first visit, so this touch does not count. Hold it as then: what is not known of the pen then moves all visits alike.</source>
        <translation>光笔的倾斜与首次触测监视点时不同，此次触测不计入。请保持与当时相同的姿态：这样光笔的未知误差对各次触测的影响相同。</translation>
    </message>
    <message>
        <source>The picture {path} is not the one that was kept. Keep it again.</source>
        <translation>图片 {path} 已不是当初保存的那张。请重新保存。</translation>
    </message>
    <message>
        <source>The record of {entry} is missing or was changed. Get the entries from their station again.</source>
        <translation>{entry}的标定数据缺失或被改动过。请从其工位重新获取这些条目。</translation>
    </message>
    <message>
        <source>The result {file} is damaged. Restore it from a copy, or move it away to go on without it.</source>
        <translation>结果 {file} 已损坏。请用备份恢复，或移走后不用它继续。</translation>
    </message>
    <message>
        <source>The result {file} was written by a later version of the program (format {number}; this version reads up to {known}). Use that version, or move the file away to go on without it.</source>
        <translation>结果 {file} 由更新版本的程序写入（格式 {number}；本版本最高读取 {known}）。请使用该版本，或移走该文件后不用它继续。</translation>
    </message>
    <message>
        <source>The rotations look as if they were made of quaternions read in the wrong order (w x y z or x y z w): as they are read the poses scatter by {as_read:.3g} mm about one tip, in the other order by {undone:.3g} mm. Convert them again with the scalar in its place.</source>
        <translation>旋转似乎由四元数按错误的顺序（w x y z 或 x y z w）换算而来：按现有数据，各位姿的测头散布为 {as_read:.3g} mm，改用另一顺序则为 {undone:.3g} mm。请将标量放在正确的位置后重新换算。</translation>
    </message>
    <message>
        <source>The rotations look transposed: as they are read the poses scatter by {as_read:.3g} mm about one tip, transposed by {undone:.3g} mm. Give r11 to r33 row by row, and both rotation and translation of cam_from_pen.</source>
        <translation>旋转矩阵似乎被转置：按现有数据，各位姿的测头散布为 {as_read:.3g} mm，转置后为 {undone:.3g} mm。请按行给出 r11 至 r33，且旋转与平移均为 cam_from_pen。</translation>
    </message>
    <message>
        <source>The settings cannot be saved: {file} cannot be written ({reason}). Make sure that its folder is yours to write and that the disk is not full.</source>
        <translation>无法保存设置：无法写入 {file}（{reason}）。请确认您对其文件夹有写入权限，且磁盘未满。</translation>
    </message>
    <message>
        <source>The settings {file} are damaged and were set aside as {aside}. Restore them from a copy, or choose anew what is missing.</source>
        <translation>设置文件 {file} 已损坏，已另存为 {aside}。请用备份恢复，或重新选择缺少的内容。</translation>
    </message>
    <message>
        <source>The settings {file} were saved, though another program kept them to itself for {seconds:g} s. End that program if it hangs, or it may change them back.</source>
        <translation>设置 {file} 已保存，但另一个程序将其占用了 {seconds:g} s。如果该程序已无响应，请结束它，否则它可能会把设置改回去。</translation>
    </message>
    <message>
        <source>The sign of t{axis} looks wrong: as they are read the poses scatter by {as_read:.3g} mm about one tip, with the other sign by {undone:.3g} mm. Give rotations and translations in the same right-handed frame.</source>
        <translation>t{axis} 的符号似乎有误：按现有数据，各位姿的测头散布为 {as_read:.3g} mm，改变符号后为 {undone:.3g} mm。请在同一右手坐标系中给出旋转和平移。</translation>
    </message>
    <message>
        <source>The simulated camera has no pixel format {wanted}; it has {offered}. Choose one of these.</source>
        <translation>模拟相机没有像素格式 {wanted}；可用的有 {offered}。请从中选择。</translation>
    </message>
    <message>
        <source>The simulated camera {serial} is not plugged in. Plug it in.</source>
        <translation>模拟相机 {serial} 未插上。请插上。</translation>
    </message>
    <message>
        <source>The simulated camera {serial} no longer answers. Check its cable and its power.</source>
        <translation>模拟相机 {serial} 不再响应。请检查线缆和电源。</translation>
    </message>
    <message>
        <source>The simulated camera {serial} sent no image for {waited:.1f} s. Check its cable.</source>
        <translation>模拟相机 {serial} 已有 {waited:.1f} s 没有送来图像。请检查线缆。</translation>
    </message>
    <message>
        <source>The swing in {folder} cannot be read: {reason}. Make sure that it is yours to read, or move the folder away.</source>
        <translation>{folder} 中的摆动无法读取：{reason}。请确认您有读取权限，或移走该文件夹。</translation>
    </message>
    <message>
        <source>The swing in {folder} has changed since it was read: another program wrote to it. Read it again to go on with all of its images.</source>
        <translation>{folder} 中的摆动在读取后有变化：另一个程序写入过。请重新读取，以便用全部图像继续。</translation>
    </message>
    <message>
        <source>The swing in {folder} has changed since its tip was computed. Compute it again to accept it.</source>
        <translation>{folder} 中的摆动在计算测头后有变化。请重新计算后再接受。</translation>
    </message>
    <message>
        <source>The swing is paused.</source>
        <translation>摆动已暂停。</translation>
    </message>
    <message>
        <source>The tip did not come to rest in the same place: it moved by {distance:.4f} mm (standard deviation) from image to image. Clean tip and cone, look for wear, and press the tip in. It is in the uncertainty.</source>
        <translation>测头没有停在同一位置：各图像之间移动 {distance:.4f} mm（标准差）。请清洁测头和锥孔，检查磨损，并将测头压入。该影响已计入不确定度。</translation>
    </message>
    <message>
        <source>The tip is that of the first, which are more.</source>
        <translation>所得测头属于位姿较多的前一组。</translation>
    </message>
    <message>
        <source>The tip moved in its seat as the pen leant, by some {distance:.4f} mm. Tip or cone may be out of round, worn or dirty. It is in the uncertainty.</source>
        <translation>测头随光笔倾斜在锥孔中移动约 {distance:.4f} mm。测头或锥孔可能不圆、磨损或有污物。该影响已计入不确定度。</translation>
    </message>
    <message>
        <source>The tip rested on two points, {distance:.2f} mm apart, as if cone or tracker had moved. On one: poses {first}. On the other: poses {second}. {consequence}</source>
        <translation>测头曾停在两个点上，相距 {distance:.2f} mm，似乎锥孔或跟踪仪移动过。一个点：位姿 {first}。另一个点：位姿 {second}。{consequence}</translation>
    </message>
    <message>
        <source>The tip rests in the cone. Keep it pressed in.</source>
        <translation>测头已在锥孔中。请保持压紧。</translation>
    </message>
    <message>
        <source>The tip would be {length:.0f} m from the origin of the pen. Millimetres are needed: check the units of tx, ty and tz.</source>
        <translation>测头距光笔原点竟有 {length:.0f} m。长度需以毫米为单位：请检查 tx、ty、tz 的单位。</translation>
    </message>
    <message>
        <source>The tip would be {tip:.0f} mm from the origin of the pen, farther than the pivot from that of the camera ({pivot:.0f} mm). Inverted poses give this: if they are pen_from_cam, tip and pivot have to change places.</source>
        <translation>测头距光笔原点 {tip:.0f} mm，比支点距相机原点（{pivot:.0f} mm）更远。位姿求逆后正是如此：如果给出的是 pen_from_cam，则测头与支点应互换。</translation>
    </message>
    <message>
        <source>The translations look like metres: as millimetres they are only {typical:.3f} mm long (median). Millimetres are needed: multiply tx, ty and tz by 1000.</source>
        <translation>平移似乎以米为单位：若按毫米计，其长度只有 {typical:.3f} mm（中位数）。需要毫米：请将 tx、ty、tz 乘以 1000。</translation>
    </message>
    <message>
        <source>The verification was begun with another file of the camera or of the LEDs than is chosen now. Choose that file, and go on with it.</source>
        <translation>该验证开始时使用的相机文件或 LED 文件与当前选择的不同。请选择当时的文件，然后继续。</translation>
    </message>
    <message>
        <source>The verification was of {result}, and another result is in force for tip {tip} of pen {pen} by now. Close the verification, and begin another one.</source>
        <translation>该验证针对 {result}，而光笔 {pen} 的测头 {tip} 现已有其他结果生效。请结束该验证并重新开始。</translation>
    </message>
    <message>
        <source>The video {path} cannot be decoded within {most:.0f} MB. Save its frames as images.</source>
        <translation>视频 {path} 无法在 {most:.0f} MB 内存内解码。请将其各帧另存为图像。</translation>
    </message>
    <message>
        <source>The video {path} cannot be opened, or holds no frames. Check that it plays, or save its frames as images.</source>
        <translation>视频 {path} 无法打开，或没有帧。请检查能否播放，或把各帧保存为图像。</translation>
    </message>
    <message>
        <source>The video {path} has more than {most} frames. Cut out the swing, or save its frames as images.</source>
        <translation>视频 {path} 超过 {most} 帧。请截取摆动部分，或将各帧另存为图像。</translation>
    </message>
    <message>
        <source>The video {path} is coded as {codec}, which is not read here. Save it with FFV1 or MJPG, or save its frames as images.</source>
        <translation>视频 {path} 的编码为 {codec}，此处不支持。请以 FFV1 或 MJPG 编码保存，或将各帧另存为图像。</translation>
    </message>
    <message>
        <source>The witness stays within {distance:.4f} mm, but U of it is {uncertainty:.4f} mm, more than the limit of {limit:.4f} mm: a move of that size would not show.</source>
        <translation>监视点的位移不超过 {distance:.4f} mm，但其 U 为 {uncertainty:.4f} mm，大于限值 {limit:.4f} mm：这样大小的位移无法察觉。</translation>
    </message>
    <message>
        <source>The {what} of recorded images cannot be changed. Choose a live camera.</source>
        <translation>录制图像的{what}无法更改。请选择实时相机。</translation>
    </message>
    <message>
        <source>The {what} {path} cannot be read: {reason}. Check that it is yours to read and that its disk is connected.</source>
        <translation>{what} {path} 无法读取：{reason}。请检查您是否有读取权限，磁盘是否已连接。</translation>
    </message>
    <message>
        <source>The {what} {path} does not exist. Check the name and the folder.</source>
        <translation>{what} {path} 不存在。请检查名称和文件夹。</translation>
    </message>
    <message>
        <source>The {what} {path} has {size:.1f} MB, more than the {limit:g} MB such a file may have. Check that the right file is named.</source>
        <translation>{what} {path} 有 {size:.1f} MB，超过此类文件允许的 {limit:g} MB。请检查是否选对了文件。</translation>
    </message>
    <message>
        <source>The {what} {path} holds nothing but blanks. Save it again.</source>
        <translation>{what} {path} 只有空白。请重新保存。</translation>
    </message>
    <message>
        <source>The {what} {path} is a folder. Name the file itself.</source>
        <translation>{what} {path} 是文件夹。请选择文件本身。</translation>
    </message>
    <message>
        <source>The {what} {path} is a pipe or a device. Name a file on a disk.</source>
        <translation>{what} {path} 是管道或设备。请选择磁盘上的文件。</translation>
    </message>
    <message>
        <source>The {what} {path} is empty. Check how it was saved or copied.</source>
        <translation>{what} {path} 是空的。请检查它是如何保存或复制的。</translation>
    </message>
    <message>
        <source>The {what} {path} is not text: byte {byte} fits no known encoding. Check that the right file is named, or save it as UTF-8.</source>
        <translation>{what} {path} 不是文本：第 {byte} 个字节不符合任何已知编码。请检查是否选对了文件，或另存为 UTF-8。</translation>
    </message>
    <message>
        <source>The {what} {path} is not text: line {line} holds the control character {character}. Check that the right file is named, or save it as UTF-8.</source>
        <translation>{what} {path} 不是文本：第 {line} 行含有控制字符 {character}。请检查是否选对了文件，或另存为 UTF-8。</translation>
    </message>
    <message>
        <source>There is no archive {file}, or nothing was entered in it yet. Check the data folder.</source>
        <translation>没有档案 {file}，或其中尚无任何条目。请检查数据文件夹。</translation>
    </message>
    <message>
        <source>There is no display to open a window on. Start the program at a screen, or give a command; lightpen --help lists them.</source>
        <translation>没有可以打开窗口的显示器。请在屏幕前启动程序，或给出命令；用 lightpen --help 查看命令。</translation>
    </message>
    <message>
        <source>There is no folder, video or image at {place}. Check the name.</source>
        <translation>{place} 处没有文件夹、视频或图像。请检查名称。</translation>
    </message>
    <message>
        <source>There is no supervisor&apos;s password yet. Type one at Start, where all limits of the station are.</source>
        <translation>尚无主管密码。请在“开始”步骤的全部限值处设置。</translation>
    </message>
    <message>
        <source>This computer is too slow: {n_missed} of {n_offered} images were not measured. Close other programs, or the swing takes longer.</source>
        <translation>本机速度不够：{n_offered} 幅图像中有 {n_missed} 幅未测量。请关闭其他程序，否则摆动会更久。</translation>
    </message>
    <message>
        <source>Tilt the pen to all sides, by 20 degrees or more, not only about its own axis.</source>
        <translation>请把光笔向各个方向倾斜 20° 以上，而不只是绕自身轴线转动。</translation>
    </message>
    <message>
        <source>To YOUR right: it tells the program where you stand.</source>
        <translation>朝自己右侧：程序由此得知您站在哪里。</translation>
    </message>
    <message>
        <source>Too little tilt {sides}. Lean the pen further that way. Images still needed: about {n_images}.</source>
        <translation>{sides}倾斜不足。请朝该方向再倾斜一些：约需 {n_images} 幅图像。</translation>
    </message>
    <message>
        <source>Turn its LEDs to the camera; nothing is lost meanwhile.</source>
        <translation>把 LED 转向相机；期间不会丢失任何数据。</translation>
    </message>
    <message>
        <source>U (k = 2) of the tip is {uncertainty:.4f} mm, the limit {limit:.4f} mm. Capture more images in postures that differ.</source>
        <translation>测头的 U (k = 2) 为 {uncertainty:.4f} mm，限值 {limit:.4f} mm。请以不同姿态继续采集。</translation>
    </message>
    <message>
        <source>U (k = 2) of the tip is {uncertainty:.4f} mm, the limit {limit:.4f} mm. {share:.4f} mm of it comes from {advice}. More images hardly help.</source>
        <translation>测头的 U (k = 2) 为 {uncertainty:.4f} mm，限值 {limit:.4f} mm。其中 {share:.4f} mm 来自{advice}。增加图像几乎没有帮助。</translation>
    </message>
    <message>
        <source>U (k = 2) of the tip is {uncertainty:.4f} mm, the limit {limit:.4f} mm. {share:.4f} mm of it is assumed, for {advice}. More images hardly help.</source>
        <translation>测头的 U (k = 2) 为 {uncertainty:.4f} mm，限值 {limit:.4f} mm。其中 {share:.4f} mm 为假定值，来自{advice}。增加图像几乎没有帮助。</translation>
    </message>
    <message>
        <source>U (k = 2) of the tip is {uncertainty:.4f} mm.</source>
        <translation>测头的 U (k = 2) 为 {uncertainty:.4f} mm。</translation>
    </message>
    <message>
        <source>What is kept here does not go on with {entry}. A data folder was copied and both copies were gone on with, or entries were changed. Check both archives.</source>
        <translation>此处保存的内容与{entry}不相接。可能是数据文件夹被复制后两份都在继续使用，或条目被改动过。请检查两边的档案库。</translation>
    </message>
    <message>
        <source>What would pass is CHECK nevertheless if odd and even images put the tip apart by more than the limit and by more than {halves:g} times U (k = 2) of their difference, if the images contradict a file by more than {contradicted:g} standard deviations, if cone and camera moved by more than {moved:.4f} mm, if the residuals exceed {sigma:g} px, if an LED stands out by more than {displaced:g} mm, if one of several cameras is out of step, if more than {dropped:.0f} % of the images that show the pen take no part, if fewer than {n_images} images show it, or none on one of the eight sides.</source>
        <translation>即使 U 合格，出现下列任一情形仍判为“需检查”：由奇数图像与偶数图像求得的测头之差既超过限值，又超过该差值 U (k = 2) 的 {halves:g} 倍；图像与文件的矛盾超过 {contradicted:g} 倍标准差；锥孔与相机的相对移动超过 {moved:.4f} mm；残差超过 {sigma:g} px；某个 LED 明显偏离且超过 {displaced:g} mm；多台相机中有一台不同步；拍到光笔的图像中未参与计算的超过 {dropped:.0f} %；拍到光笔的图像少于 {n_images} 幅；八个方向中有一个方向没有图像。</translation>
    </message>
    <message>
        <source>Where the tip has a limit of its own for its change, the distance from the tip that was in force before (as found) to the tip that is accepted (as left) is compared with it by simple acceptance; beyond it is CHECK.</source>
        <translation>若测头自有变化限值，则将此前有效的测头（标定前状态）与所接受测头（标定后状态）之间的距离按简单接受与之比较；超出则为“需检查”。</translation>
    </message>
    <message>
        <source>Without these images there is no tip, so they stay in. {why}</source>
        <translation>剔除这些图像后求不出测头，因此它们仍参与计算。{why}</translation>
    </message>
    <message>
        <source>a cell is empty where a number is needed.</source>
        <translation>需要数字的单元格为空。</translation>
    </message>
    <message>
        <source>a dash in place of a minus sign</source>
        <translation>用破折号代替减号</translation>
    </message>
    <message>
        <source>a typographic minus sign</source>
        <translation>排版用减号</translation>
    </message>
    <message>
        <source>ambiguous</source>
        <translation>有歧义</translation>
    </message>
    <message>
        <source>away from the camera</source>
        <translation>远离相机方向</translation>
    </message>
    <message>
        <source>away to the left</source>
        <translation>远离相机偏左</translation>
    </message>
    <message>
        <source>away to the right</source>
        <translation>远离相机偏右</translation>
    </message>
    <message>
        <source>blank inside</source>
        <translation>中间有空格</translation>
    </message>
    <message>
        <source>blurred</source>
        <translation>图像模糊</translation>
    </message>
    <message>
        <source>c11 to c66 are not a covariance: they must be symmetric, with correlations from -1 to 1. Correct or remove these columns.</source>
        <translation>c11 至 c66 不是协方差：必须对称，相关系数在 -1 到 1 之间。请改正或删除这些列。</translation>
    </message>
    <message>
        <source>calibration of a camera</source>
        <translation>相机标定</translation>
    </message>
    <message>
        <source>camera file</source>
        <translation>内参文件</translation>
    </message>
    <message>
        <source>cone</source>
        <translation>锥孔</translation>
    </message>
    <message>
        <source>distortion coefficient {name}</source>
        <translation>畸变系数 {name}</translation>
    </message>
    <message>
        <source>entry {number} of the station {station}</source>
        <translation>工位 {station} 的第 {number} 个条目</translation>
    </message>
    <message>
        <source>exposure</source>
        <translation>曝光</translation>
    </message>
    <message>
        <source>file of LED centres</source>
        <translation>LED 中心文件</translation>
    </message>
    <message>
        <source>file of a verification under way</source>
        <translation>进行中的验证的文件</translation>
    </message>
    <message>
        <source>file of the tip library</source>
        <translation>测头库文件</translation>
    </message>
    <message>
        <source>focal length</source>
        <translation>焦距</translation>
    </message>
    <message>
        <source>folder</source>
        <translation>文件夹</translation>
    </message>
    <message>
        <source>gain</source>
        <translation>增益</translation>
    </message>
    <message>
        <source>image</source>
        <translation>图像</translation>
    </message>
    <message>
        <source>it is not a list of numbers.</source>
        <translation>不是数字列表。</translation>
    </message>
    <message>
        <source>its folder does not exist. Create the folder, or choose another.</source>
        <translation>所在文件夹不存在。请创建文件夹，或选择其他文件夹。</translation>
    </message>
    <message>
        <source>its folder is not a folder. Check the path.</source>
        <translation>所在位置不是文件夹。请检查路径。</translation>
    </message>
    <message>
        <source>journal</source>
        <translation>日志文件</translation>
    </message>
    <message>
        <source>leds in {name} is no list of LEDs. Write it as [{{&quot;led&quot;: 1, &quot;x&quot;: 0, &quot;y&quot;: 0, &quot;z&quot;: -30}}, ...].</source>
        <translation>{name} 中的 leds 不是 LED 列表。请写成 [{{&quot;led&quot;: 1, &quot;x&quot;: 0, &quot;y&quot;: 0, &quot;z&quot;: -30}}, ...]。</translation>
    </message>
    <message>
        <source>letter {letter}</source>
        <translation>字母 {letter}</translation>
    </message>
    <message>
        <source>no LED seen</source>
        <translation>看不到 LED</translation>
    </message>
    <message>
        <source>pen</source>
        <translation>光笔</translation>
    </message>
    <message>
        <source>pen file</source>
        <translation>LED 文件</translation>
    </message>
    <message>
        <source>permission is denied. Choose another folder, or ask for access.</source>
        <translation>没有权限。请选择其他文件夹，或申请权限。</translation>
    </message>
    <message>
        <source>picture</source>
        <translation>图片</translation>
    </message>
    <message>
        <source>pose file</source>
        <translation>位姿文件</translation>
    </message>
    <message>
        <source>pose {pose:g} is given on line {line} already. Remove what was copied twice.</source>
        <translation>位姿 {pose:g} 已在第 {line} 行给出。请删除重复复制的内容。</translation>
    </message>
    <message>
        <source>poses</source>
        <translation>位姿</translation>
    </message>
    <message>
        <source>principal point cx</source>
        <translation>主点 cx</translation>
    </message>
    <message>
        <source>principal point cy</source>
        <translation>主点 cy</translation>
    </message>
    <message>
        <source>r11 to r33 are a mirrored rotation (determinant -1). Give the poses in right-handed frames.</source>
        <translation>r11 至 r33 是镜像旋转（行列式为 -1）。请用右手坐标系给出位姿。</translation>
    </message>
    <message>
        <source>r11 to r33 are not a rotation: their rows must have the length 1 and be at right angles to each other. Check the order of the columns.</source>
        <translation>r11 至 r33 不是旋转矩阵：各行长度必须为 1 且相互垂直。请检查列的顺序。</translation>
    </message>
    <message>
        <source>ratio fy / fx of the focal lengths</source>
        <translation>焦距之比 fy / fx</translation>
    </message>
    <message>
        <source>record&apos;s header</source>
        <translation>记录头文件</translation>
    </message>
    <message>
        <source>result</source>
        <translation>结果</translation>
    </message>
    <message>
        <source>settings file</source>
        <translation>设置文件</translation>
    </message>
    <message>
        <source>source of images</source>
        <translation>图像来源</translation>
    </message>
    <message>
        <source>spots do not fit the pen</source>
        <translation>光点与光笔不匹配</translation>
    </message>
    <message>
        <source>taken out</source>
        <translation>已剔除</translation>
    </message>
    <message>
        <source>the LED centres, which are off alike whenever the pen leans alike. Focus the lens, light the LEDs evenly, and state how far off they are left</source>
        <translation>LED 中心，光笔姿态相同时其偏差也相同。请对焦镜头，使 LED 发光均匀，并给出剩余的偏差</translation>
    </message>
    <message>
        <source>the LED file. Measure the LEDs better, and state how well</source>
        <translation>LED 文件。请更精确地测量 LED，并给出其不确定度</translation>
    </message>
    <message>
        <source>the LEDs of a pen</source>
        <translation>光笔的 LED</translation>
    </message>
    <message>
        <source>the camera file. Calibrate the camera, and state the covariance in its file</source>
        <translation>内参文件。请标定相机，并在文件中给出协方差</translation>
    </message>
    <message>
        <source>the covariance c11 to c66 leaves a direction without any uncertainty, which no measurement does. Correct or remove these columns.</source>
        <translation>协方差 c11 至 c66 使某个方向没有不确定度，这在测量中不可能。请改正或删除这些列。</translation>
    </message>
    <message>
        <source>the direction ({x:.2f}, {y:.2f}, {z:.2f}) of the pen</source>
        <translation>光笔的方向 ({x:.2f}, {y:.2f}, {z:.2f})</translation>
    </message>
    <message>
        <source>the disk is full. Free some space, or write to another disk.</source>
        <translation>磁盘已满。请清理空间，或写到其他磁盘。</translation>
    </message>
    <message>
        <source>the disk is read-only. Choose another folder.</source>
        <translation>磁盘是只读的。请选择其他文件夹。</translation>
    </message>
    <message>
        <source>the distance of the two cones. Have it measured better</source>
        <translation>两个锥孔的间距。请更精确地测量它</translation>
    </message>
    <message>
        <source>the file ends within the number {number}, which has {n_decimals} decimals where all others have {n_others}. Copy the file again, or remove the line.</source>
        <translation>文件在数字 {number} 处中断：它有 {n_decimals} 位小数，而其他都有 {n_others} 位。请重新复制文件，或删除该行。</translation>
    </message>
    <message>
        <source>the file has decimal points and decimal commas, the other ones on line {line}. Use one of them throughout.</source>
        <translation>文件中小数点和小数逗号混用，另一种在第 {line} 行。请统一使用一种。</translation>
    </message>
    <message>
        <source>the file would be larger than allowed here. Write to another disk.</source>
        <translation>文件超过此处允许的大小。请写到其他磁盘。</translation>
    </message>
    <message>
        <source>the name is a link that leads back to itself. Choose another name.</source>
        <translation>该名称是指向自身的链接。请另选名称。</translation>
    </message>
    <message>
        <source>the name is too long. Choose a shorter one.</source>
        <translation>名称太长。请选择较短的名称。</translation>
    </message>
    <message>
        <source>the pen&apos;s {axis} axis</source>
        <translation>光笔的 {axis} 轴</translation>
    </message>
    <message>
        <source>the program failed on it</source>
        <translation>程序处理出错</translation>
    </message>
    <message>
        <source>the scale of the LED file. Have the LEDs measured by a better length, and state how well, or swing in two cones at a known distance</source>
        <translation>LED 文件的尺度。请用更准确的长度标准测量 LED 并给出其不确定度，或在间距已知的两个锥孔中摆动</translation>
    </message>
    <message>
        <source>the scatter of the poses, and that it hangs together from pose to pose</source>
        <translation>位姿的散布，以及相邻位姿之间的相关性</translation>
    </message>
    <message>
        <source>the temperature of the pen. State its expansion in the LED file, and measure its temperature at the swing</source>
        <translation>光笔的温度。请在 LED 文件中给出其膨胀系数，并在摆动时测量其温度</translation>
    </message>
    <message>
        <source>the translation is more than {most:g} m. Check its units: millimetres are needed.</source>
        <translation>平移超过 {most:g} m。请检查单位：需要毫米。</translation>
    </message>
    <message>
        <source>the {what} is {value:g} where the first LED has {first:g}. It must be the same for all LEDs of a pen.</source>
        <translation>{what} 为 {value:g}，而第一个 LED 为 {first:g}。同一光笔的所有 LED 必须相同。</translation>
    </message>
    <message>
        <source>there is a file of that name already. Try again.</source>
        <translation>已有同名文件。请重试。</translation>
    </message>
    <message>
        <source>there is no LED {led}; the pen has LEDs 1 to {n_leds}. Check that the pen file is of this pen, and that LEDs are numbered from 1.</source>
        <translation>没有 LED {led}；光笔有 LED 1 至 {n_leds}。请检查 LED 文件是否属于这支光笔，LED 是否从 1 开始编号。</translation>
    </message>
    <message>
        <source>tip</source>
        <translation>测头</translation>
    </message>
    <message>
        <source>tip slipped</source>
        <translation>测头滑动</translation>
    </message>
    <message>
        <source>to most sides</source>
        <translation>向多数方向</translation>
    </message>
    <message>
        <source>to the left</source>
        <translation>向左</translation>
    </message>
    <message>
        <source>to the right</source>
        <translation>向右</translation>
    </message>
    <message>
        <source>too few LEDs</source>
        <translation>LED 太少</translation>
    </message>
    <message>
        <source>towards the camera</source>
        <translation>朝向相机方向</translation>
    </message>
    <message>
        <source>towards the camera to the left</source>
        <translation>朝向相机偏左</translation>
    </message>
    <message>
        <source>towards the camera to the right</source>
        <translation>朝向相机偏右</translation>
    </message>
    <message>
        <source>translation of cam_from_rig along {axis}</source>
        <translation>cam_from_rig 沿 {axis} 轴的平移</translation>
    </message>
    <message>
        <source>underscore</source>
        <translation>下划线</translation>
    </message>
    <message>
        <source>unreadable</source>
        <translation>无法读取</translation>
    </message>
    <message>
        <source>what stays the same in all poses: the scale of the tracker and of the pen, a tip that is worn or does not seat</source>
        <translation>在所有位姿中保持不变的误差：跟踪仪和光笔的尺度、测头磨损或未就位</translation>
    </message>
    <message>
        <source>where the cameras stand. Calibrate the rig, and state how well</source>
        <translation>各相机的位置。请标定相机组，并给出其不确定度</translation>
    </message>
    <message>
        <source>wrong size</source>
        <translation>尺寸不符</translation>
    </message>
    <message>
        <source>y must grow from LED 1 to LED 4. Change the sign of all y.</source>
        <translation>y 必须从 LED 1 到 LED 4 递增。请改变所有 y 的符号。</translation>
    </message>
    <message>
        <source>your disk quota is used up. Free some space, or write elsewhere.</source>
        <translation>磁盘配额已用完。请清理空间，或写到其他地方。</translation>
    </message>
    <message>
        <source>{address} is no address of this computer. Give one that it has in the network that may listen, or {loopback} for this computer alone.</source>
        <translation>{address} 不是本机的地址。请填写本机在允许接收的网络中的地址，或填写 {loopback} 仅限本机。</translation>
    </message>
    <message>
        <source>{cell} is not a finite number.</source>
        <translation>{cell} 不是有限数。</translation>
    </message>
    <message>
        <source>{cell} is not a number ({meaning}).</source>
        <translation>{cell} 不是数字（{meaning}）。</translation>
    </message>
    <message>
        <source>{cell} is not a number.</source>
        <translation>{cell} 不是数字。</translation>
    </message>
    <message>
        <source>{cell} is not a whole number.</source>
        <translation>{cell} 不是整数。</translation>
    </message>
    <message>
        <source>{cell} is too large a number.</source>
        <translation>{cell} 数值过大。</translation>
    </message>
    <message>
        <source>{count} columns</source>
        <translation>{count} 列</translation>
    </message>
    <message>
        <source>{count} distortion coefficients</source>
        <translation>{count} 个畸变系数</translation>
    </message>
    <message>
        <source>{count} is too few or too many: 1 to {most} days or swings are possible until a tip is due.</source>
        <translation>{count} 太少或太多：测头到期前的天数或摆动次数可为 1 至 {most}。</translation>
    </message>
    <message>
        <source>{count} numbers</source>
        <translation>{count} 个数</translation>
    </message>
    <message>
        <source>{direction} Its lengths seem to be in {unit}; millimetres are needed.</source>
        <translation>{direction}其长度单位似乎是{unit}；此处需要毫米。</translation>
    </message>
    <message>
        <source>{entry} in {name} cannot be read: {flaw} Correct it, or export the file again.</source>
        <translation>{name} 中的 {entry} 无法读取：{flaw}请改正，或重新导出文件。</translation>
    </message>
    <message>
        <source>{entry} in {name} has no named values below it. The file may be cut short: copy or export it again.</source>
        <translation>{name} 中的 {entry} 下面没有命名的值。文件可能不完整：请重新复制或导出。</translation>
    </message>
    <message>
        <source>{entry} in {name} has {counted} where its {rows:g} rows of {cols:g} need {needed:g}. The file may be cut short: copy or export it again.</source>
        <translation>{name} 中的 {entry} 有 {counted}，而 {rows:g} 行 {cols:g} 列需要 {needed:g} 个。文件可能不完整：请重新复制或导出。</translation>
    </message>
    <message>
        <source>{entry} in {name} has {counted} where {needed} are needed. Correct it, or export the file again.</source>
        <translation>{name} 中的 {entry} 有 {counted}，需要 {needed} 个。请改正，或重新导出文件。</translation>
    </message>
    <message>
        <source>{entry} in {name} has {counted}; at most {most} are read. Correct it, or export the file again.</source>
        <translation>{name} 中的 {entry} 有 {counted}；最多读取 {most} 个。请更正，或重新导出文件。</translation>
    </message>
    <message>
        <source>{entry} in {name} must hold {needed} numbers, none of them negative: of fx fy cx cy and the {n_coefficients} distortion coefficients. Correct or remove it.</source>
        <translation>{name} 中的 {entry} 必须含 {needed} 个非负数：fx fy cx cy 以及 {n_coefficients} 个畸变系数。请改正或删除。</translation>
    </message>
    <message>
        <source>{file} is damaged: the verification that it is of cannot be gone on with. The images of its touches stay where they are.</source>
        <translation>{file} 已损坏：无法继续它所属的验证。其触测图像保留在原处。</translation>
    </message>
    <message>
        <source>{folder} holds images of a swing, but no {name}. Restore this file from a copy, or move the folder away.</source>
        <translation>{folder} 中有摆动的图像，但没有 {name}。请用备份恢复该文件，或移走文件夹。</translation>
    </message>
    <message>
        <source>{journal} knows none of the {n_images} images in its folder. Restore this file from a copy.</source>
        <translation>{journal} 中没有其文件夹内 {n_images} 幅图像的任何一幅。请用备份恢复该文件。</translation>
    </message>
    <message>
        <source>{key} is given a second time in {name}. Keep the right one.</source>
        <translation>{name} 中重复给出 {key}。请保留正确的一个。</translation>
    </message>
    <message>
        <source>{key} is given a second time on line {line} in {name}. Keep the right one.</source>
        <translation>{name} 第 {line} 行重复给出 {key}。请保留正确的一个。</translation>
    </message>
    <message>
        <source>{key} of {place} is a mirrored rotation (determinant -1). Both cameras need right-handed frames: u right, v down, w forward.</source>
        <translation>{place}的 {key} 是镜像旋转（行列式为 -1）。两台相机都需要右手坐标系：u 向右，v 向下，w 向前。</translation>
    </message>
    <message>
        <source>{key} of {place} is a quaternion of length {length:.4g}; 1 is needed. Give it as w x y z.</source>
        <translation>{place}的 {key} 是长度为 {length:.4g} 的四元数；长度应为 1。请按 w x y z 的顺序给出。</translation>
    </message>
    <message>
        <source>{key} of {place} is more than {most:g} m. Check its units: millimetres are needed.</source>
        <translation>{place}的 {key} 超过 {most:g} m。请检查其单位：此处需要毫米。</translation>
    </message>
    <message>
        <source>{key} of {place} is no rotation: its rows must have the length 1 and be at right angles to each other. Give the matrix row by row, or a unit quaternion w x y z.</source>
        <translation>{place}的 {key} 不是旋转：各行的长度必须为 1 且两两垂直。请逐行给出矩阵，或给出单位四元数 w x y z。</translation>
    </message>
    <message>
        <source>{key} of {place} must hold what the turn about x y z (rad) and the translation (mm) are uncertain by: 6 standard deviations, none of them negative, or a covariance, symmetric and positive; up to 1 rad and 10 m. Correct or remove it.</source>
        <translation>{place}的 {key} 必须给出绕 x y z 的转角（rad）和平移（mm）的不确定度：6 个非负的标准差，或一个对称的正定协方差矩阵；最大为 1 rad 和 10 m。请更正或删除它。</translation>
    </message>
    <message>
        <source>{led} where {other} belongs</source>
        <translation>{other} 的位置上是 {led}</translation>
    </message>
    <message>
        <source>{n_dropped} of {n_images} images do not take part. Repeat the swing if the tip slipped.</source>
        <translation>{n_images} 幅图像中有 {n_dropped} 幅未参与计算。若测头滑动过，请重做摆动。</translation>
    </message>
    <message>
        <source>{n_failed} of {n_trials} trials gave no tip: the swing is too poor to be repeated by simulation. Capture more images in other postures.</source>
        <translation>{n_trials} 次模拟中有 {n_failed} 次求不出测头：该摆动太差，无法用模拟重复。请以其他姿态采集更多图像。</translation>
    </message>
    <message>
        <source>{n_images} {reason}</source>
        <translation>{reason} {n_images} 幅</translation>
    </message>
    <message>
        <source>{n_left_out} of {n_poses} poses agree with no common tip and were left out: {poses}. Look for what disturbed the tracking.</source>
        <translation>{n_poses} 个位姿中有 {n_left_out} 个与共同的测头不符，已剔除：{poses}。请查找干扰跟踪的原因。</translation>
    </message>
    <message>
        <source>{n_left_out} of {n_touches} touches lie elsewhere and were left out, the first {first}: the pen was lifted there, or slipped.</source>
        <translation>{n_touches} 次触测中有 {n_left_out} 次位于别处，已剔除，第一次为 {first}：光笔在该处抬起或滑动。</translation>
    </message>
    <message>
        <source>{n_left_out} touches lie off the ring and were left out, the first {first}: the pen was lifted there, or slipped.</source>
        <translation>{n_left_out} 次触测不在环上，已剔除，第一次为 {first}：光笔在该处抬起或滑动。</translation>
    </message>
    <message>
        <source>{n_pairs} of {n_moments} moments show the pen to camera {camera} and to another one; {needed} are needed to tell how both stand. Give the images of one moment the same name, and turn the cameras so that each sees the pen.</source>
        <translation>{n_moments} 个时刻中有 {n_pairs} 个同时被相机 {camera} 和另一台相机看到光笔；至少需要 {needed} 个才能确定两者的相对位置。请让同一时刻的图像同名，并转动相机使每台都能看到光笔。</translation>
    </message>
    <message>
        <source>{n_poses} poses are usable; the tip needs at least {needed}. Capture more images.</source>
        <translation>可用位姿 {n_poses} 个；求测头至少需要 {needed} 个。请采集更多图像。</translation>
    </message>
    <message>
        <source>{n_poses} poses are usable; the two-stage method starts from {needed}. Capture more images.</source>
        <translation>可用位姿 {n_poses} 个；两步法至少需要 {needed} 个。请采集更多图像。</translation>
    </message>
    <message>
        <source>{n_tips} calibration tells nothing of how well it repeats; give two at least, ten are usual.</source>
        <translation>{n_tips} 次标定看不出重复性；请至少给出两次，通常为十次。</translation>
    </message>
    <message>
        <source>{n_touches} touches of the point can be used, at least {needed} are needed, {usual} are usual. Touch the cone again, each time in another posture.</source>
        <translation>该点有 {n_touches} 次可用的触测，至少需要 {needed} 次，通常为 {usual} 次。请再次触测锥孔，每次换一个姿态。</translation>
    </message>
    <message>
        <source>{n_usable} of {n_images} images are usable</source>
        <translation>{n_images} 幅图像中有 {n_usable} 幅可用</translation>
    </message>
    <message>
        <source>{n_wrong} of {n_readable} images are {size}, the camera file was made for {width} x {height} px. Choose the file for this camera, or switch off binning and cropping.</source>
        <translation>{n_readable} 幅图像中有 {n_wrong} 幅为 {size}，而内参文件适用于 {width} × {height} px。请选择这台相机的文件，或关闭像素合并和裁剪。</translation>
    </message>
    <message>
        <source>{name} begins with {start}, which names no values. Check that the right file is named.</source>
        <translation>{name} 以 {start} 开头，其中没有命名的值。请检查是否选对了文件。</translation>
    </message>
    <message>
        <source>{name} cannot be decoded.</source>
        <translation>{name} 无法解码。</translation>
    </message>
    <message>
        <source>{name} cannot be decoded: {problem}.</source>
        <translation>{name} 无法解码：{problem}。</translation>
    </message>
    <message>
        <source>{name} describes a camera of the model {model}; the model pinhole is needed. Calibrate the camera again with pinhole-radtan.</source>
        <translation>{name} 描述的相机模型为 {model}；需要 pinhole 模型。请用 pinhole-radtan 重新标定相机。</translation>
    </message>
    <message>
        <source>{name} describes a fisheye lens ({model}). A pinhole camera is needed: calibrate the camera again with the distortion model plumb_bob (radtan) or rational_polynomial.</source>
        <translation>{name} 描述的是鱼眼镜头（{model}）。需要针孔相机：请用畸变模型 plumb_bob (radtan) 或 rational_polynomial 重新标定相机。</translation>
    </message>
    <message>
        <source>{name} describes {n_cameras} cameras. Keep the one that looks at the pen, and remove the others.</source>
        <translation>{name} 描述了 {n_cameras} 台相机。请保留观察光笔的那一台，删除其他相机。</translation>
    </message>
    <message>
        <source>{name} does not say how large the images are. Add the lines image_width and image_height, in pixels.</source>
        <translation>{name} 没有说明图像尺寸。请加上 image_width 和 image_height 两行，单位为像素。</translation>
    </message>
    <message>
        <source>{name} does not say which units its coordinates have. Name them, or write them into the header: led,x_mm,y_mm,z_mm.</source>
        <translation>{name} 未注明坐标单位。请指定单位，或写入表头：led,x_mm,y_mm,z_mm。</translation>
    </message>
    <message>
        <source>{name} gives an image size of {width:g} x {height:g} px. Two whole numbers from 1 to {most} are needed.</source>
        <translation>{name} 给出的图像尺寸为 {width:g} × {height:g} px。需要两个 1 到 {most} 的整数。</translation>
    </message>
    <message>
        <source>{name} gives {one} and {other} the same camera file {file}. Each camera needs the file of its own calibration.</source>
        <translation>{name} 为 {one} 和 {other} 指定了同一个内参文件 {file}。每台相机都需要自己的标定文件。</translation>
    </message>
    <message>
        <source>{name} has LED discs {diameter:g} mm wide. A diameter of up to {most:g} mm is needed; check its units.</source>
        <translation>{name} 的 LED 发光面直径为 {diameter:g} mm。直径不得超过 {most:g} mm；请检查单位。</translation>
    </message>
    <message>
        <source>{name} has a header but no rows below it.</source>
        <translation>{name} 只有表头，下面没有数据行。</translation>
    </message>
    <message>
        <source>{name} has a skew of {skew:g} px; cameras without skew are needed. Calibrate the camera again without estimating a skew.</source>
        <translation>{name} 的倾斜系数为 {skew:g} px；需要无倾斜的相机。请不估计倾斜系数，重新标定相机。</translation>
    </message>
    <message>
        <source>{name} has coordinates in {one} and in {other}. Give all of them in one unit.</source>
        <translation>{name} 的坐标既有 {one} 又有 {other}。请全部使用同一单位。</translation>
    </message>
    <message>
        <source>{name} has its principal point at ({cx:g}, {cy:g}) px, far outside the image of {width} x {height} px. Check that both belong to the same camera and image size.</source>
        <translation>{name} 的主点位于 ({cx:g}, {cy:g}) px，远在 {width} × {height} px 的图像之外。请检查两者是否属于同一台相机和同一图像尺寸。</translation>
    </message>
    <message>
        <source>{name} has more than {most:,} values. Check that the right file is named.</source>
        <translation>{name} 中的值超过 {most:,} 个。请检查文件是否选对。</translation>
    </message>
    <message>
        <source>{name} has more than {most} lines. Check that the right file is named, or divide it.</source>
        <translation>{name} 超过 {most} 行。请检查是否选对了文件，或把它分开。</translation>
    </message>
    <message>
        <source>{name} has no column {column}; {what} need the columns {wanted}. Its header is {header}. Name the columns so.</source>
        <translation>{name} 没有 {column} 列；{what}需要 {wanted} 各列。其表头为 {header}。请照此命名各列。</translation>
    </message>
    <message>
        <source>{name} has no header and {n_columns} columns; poses need the 12 columns r11,r12,r13,r21,r22,r23,r31,r32,r33,tx_mm,ty_mm,tz_mm, with the number of the pose before them and the covariance c11 to c66 behind them if known. Put a header line with these names on top.</source>
        <translation>{name} 没有表头，有 {n_columns} 列；位姿需要 12 列 r11,r12,r13,r21,r22,r23,r31,r32,r33,tx_mm,ty_mm,tz_mm，如已知，前面是位姿编号，后面是协方差 c11 至 c66。请在最上面加一行含这些名称的表头。</translation>
    </message>
    <message>
        <source>{name} has no header and {n_columns}; {what} need the {n_needed} columns {wanted}. Put a header line with these names on top, and separate the columns by commas, semicolons or tabs.</source>
        <translation>{name} 没有表头，有 {n_columns}；{what}需要 {n_needed} 列 {wanted}。请在最上面加一行含这些名称的表头，并用逗号、分号或制表符分隔各列。</translation>
    </message>
    <message>
        <source>{name} has no lines but comments. Check that it is complete.</source>
        <translation>{name} 只有注释行。请检查文件是否完整。</translation>
    </message>
    <message>
        <source>{name} has no rows. Check that it is complete.</source>
        <translation>{name} 没有数据行。请检查文件是否完整。</translation>
    </message>
    <message>
        <source>{name} has no {entry}. Check that the right file is named and that it is complete.</source>
        <translation>{name} 中没有 {entry}。请检查是否选对了文件，文件是否完整。</translation>
    </message>
    <message>
        <source>{name} has the distortion model {model}, which is not known here. Calibrate the camera again with plumb_bob (radtan) or rational_polynomial.</source>
        <translation>{name} 的畸变模型为 {model}，本程序不支持。请用 plumb_bob (radtan) 或 rational_polynomial 重新标定相机。</translation>
    </message>
    <message>
        <source>{name} has the focal lengths {fx:g} and {fy:g} px along u and v; with the pixels of a camera these are nearly alike. Export the file again, or calibrate the camera again.</source>
        <translation>{name} 沿 u 和 v 的焦距为 {fx:g} 和 {fy:g} px；相机的这两个值应几乎相同。请重新导出文件，或重新标定相机。</translation>
    </message>
    <message>
        <source>{name} has the focal lengths {fx:g} and {fy:g} px, too short for images of {width} x {height} px; they may be in millimetres. Give them in pixels.</source>
        <translation>{name} 的焦距为 {fx:g} 和 {fy:g} px，对 {width} × {height} px 的图像来说太短；可能以毫米为单位。请以像素给出。</translation>
    </message>
    <message>
        <source>{name} has the focal lengths {fx:g} and {fy:g} px; both must be positive. Export the file again, or calibrate the camera again.</source>
        <translation>{name} 的焦距为 {fx:g} 和 {fy:g} px；两者都必须为正。请重新导出文件，或重新标定相机。</translation>
    </message>
    <message>
        <source>{name} has the units {unit}, which are not known here. Use one of {known}.</source>
        <translation>{name} 的单位 {unit} 不受支持。请使用 {known} 之一。</translation>
    </message>
    <message>
        <source>{name} has two cameras called {camera}. Give each a name of its own.</source>
        <translation>{name} 中有两台相机都名为 {camera}。请为每台相机取不同的名称。</translation>
    </message>
    <message>
        <source>{name} has {counted}; 4, 5 or 8 are needed (k1 k2 p1 p2 k3 k4 k5 k6). Export the file again.</source>
        <translation>{name} 有 {counted}；需要 4、5 或 8 个 (k1 k2 p1 p2 k3 k4 k5 k6)。请重新导出文件。</translation>
    </message>
    <message>
        <source>{name} has {count} distortion coefficients with a thin prism or a tilted sensor; 4, 5 or 8 are supported. Calibrate the camera again without these terms.</source>
        <translation>{name} 有 {count} 个畸变系数，含薄棱镜或倾斜传感器项；支持 4、5 或 8 个。请不用这些项重新标定相机。</translation>
    </message>
    <message>
        <source>{name} has {first} and {second}, which mean the same. Keep the right one.</source>
        <translation>{name} 中有含义相同的 {first} 和 {second}。请保留正确的一个。</translation>
    </message>
    <message>
        <source>{name} has {key}, which means nothing here. Remove it, or correct it to one of {known}.</source>
        <translation>{name} 中的 {key} 没有意义。请删除，或改为 {known} 之一。</translation>
    </message>
    <message>
        <source>{name} has {n_cells:,} cells; at most {most:,} are read. Check that the right file is named, or divide it.</source>
        <translation>{name} 有 {n_cells:,} 个单元格；最多读取 {most:,} 个。请检查文件是否选对，或将其拆分。</translation>
    </message>
    <message>
        <source>{name} has {n_frames} frames; at most {most} are read. Check that the right file is named, or divide it.</source>
        <translation>{name} 有 {n_frames} 帧；最多读取 {most} 帧。请检查是否选对了文件，或把它分开。</translation>
    </message>
    <message>
        <source>{name} holds more than one YAML document. Keep one of them.</source>
        <translation>{name} 含有多个 YAML 文档。请只保留一个。</translation>
    </message>
    <message>
        <source>{name} holds values of type {value_type}; grey values of 8 or 16 bit are needed. Save the images without conversion.</source>
        <translation>{name} 的数值类型为 {value_type}；需要 8 或 16 位灰度值。请不经转换保存图像。</translation>
    </message>
    <message>
        <source>{name} is a JPEG of {n_scans} scans; at most {most} are read. Save the images as PNG.</source>
        <translation>{name} 是含 {n_scans} 次扫描的 JPEG；最多读取 {most} 次。请将图像保存为 PNG。</translation>
    </message>
    <message>
        <source>{name} is a TIFF with the compression {compression}, which is not read here. Save the images as PNG, or without compression.</source>
        <translation>{name} 是压缩方式为 {compression} 的 TIFF，此处不支持。请将图像保存为 PNG，或不压缩保存。</translation>
    </message>
    <message>
        <source>{name} is a list; a pen file is a mapping with leds and units. Write it so.</source>
        <translation>{name} 是列表；LED 文件应为含 leds 和 units 的映射。请照此编写。</translation>
    </message>
    <message>
        <source>{name} is an animation. Save its images one by one.</source>
        <translation>{name} 是动画。请将其中的图像逐幅保存。</translation>
    </message>
    <message>
        <source>{name} is cut off. Capture or copy it again.</source>
        <translation>{name} 不完整。请重新拍摄或复制。</translation>
    </message>
    <message>
        <source>{name} is damaged (wrong checksum). Capture or copy it again.</source>
        <translation>{name} 已损坏（校验和错误）。请重新拍摄或复制。</translation>
    </message>
    <message>
        <source>{name} is damaged or no image that can be read here (PNG, JPEG, BMP, TIFF, PGM, WebP). Capture or copy it again.</source>
        <translation>{name} 已损坏，或不是此处可读取的图像（PNG、JPEG、BMP、TIFF、PGM、WebP）。请重新采集或复制。</translation>
    </message>
    <message>
        <source>{name} is {width} x {height} px; at most {most:,} px are read, more than usual cameras have. Choose images of the calibrated camera.</source>
        <translation>{name} 为 {width} × {height} px；最多读取 {most:,} px，已超过一般相机的像素数。请选择已标定相机的图像。</translation>
    </message>
    <message>
        <source>{name} is nested more than {n_levels} levels deep. Check that the right file is named.</source>
        <translation>{name} 的嵌套超过 {n_levels} 层。请检查是否选对了文件。</translation>
    </message>
    <message>
        <source>{name} has the {what} {number:g}. A number above {least:g} and up to {most:g} is needed; leave it away if it is not known.</source>
        <translation>{name} 中的 {what} 为 {number:g}。需要大于 {least:g} 且不超过 {most:g} 的数；若未知请略去。</translation>
    </message>
    <message>
        <source>{name} is a table, which has no place for the name, the nominal tip and the covariance of the pen. Choose a name that ends in .json.</source>
        <translation>{name} 是表格，无处存放光笔的名称、标称测头和协方差。请选择以 .json 结尾的文件名。</translation>
    </message>
    <message>
        <source>{name} is not as it was recorded (wrong checksum). Restore it from a copy.</source>
        <translation>{name} 与记录时不同（校验和错误）。请用备份恢复。</translation>
    </message>
    <message>
        <source>{name} is not valid YAML. Check that the right file is named.</source>
        <translation>{name} 不是有效的 YAML。请检查是否选对了文件。</translation>
    </message>
    <message>
        <source>{name} is {width} x {height} px and would take {needed:.0f} MB to be decoded; at most {most:.0f} MB are given to an image. Save the images as grey PNG.</source>
        <translation>{name} 为 {width} × {height} px，解码需要 {needed:.0f} MB；每幅图像最多可用 {most:.0f} MB。请将图像保存为灰度 PNG。</translation>
    </message>
    <message>
        <source>{name} names the camera file of {camera}: {trouble}</source>
        <translation>{name} 所指定的相机 {camera} 的文件：{trouble}</translation>
    </message>
    <message>
        <source>{name} states how well it is known where {one} stands, but not of {other}. State it of all cameras but the first, or of none.</source>
        <translation>{name} 给出了 {one} 位置的不确定度，却没有给出 {other} 的。请为除第一台外的所有相机给出，或全部不给。</translation>
    </message>
    <message>
        <source>{name} states its lengths in {stated}, but the unit {given} is given. Leave the unit away, or correct the file.</source>
        <translation>{name} 注明的长度单位是 {stated}，但给出的单位是 {given}。请不要另给单位，或改正文件。</translation>
    </message>
    <message>
        <source>{name}: {flaw}</source>
        <translation>{name}：{flaw}</translation>
    </message>
    <message>
        <source>{noise:.3f} px in this image, {usual:.3f} px in the others. A finger or a reflection may cover part of an LED.</source>
        <translation>本图像 {noise:.3f} px，其他图像 {usual:.3f} px。LED 可能被手指或反光遮住一部分。</translation>
    </message>
    <message>
        <source>{others} and {last}</source>
        <translation>{others}和{last}</translation>
    </message>
    <message>
        <source>{other} was made with another pen file than {first}. Give calibrations of one pen with one pen file.</source>
        <translation>{other} 所用的 LED 文件与 {first} 不同。请给出同一支光笔、同一 LED 文件的标定结果。</translation>
    </message>
    <message>
        <source>{path} cannot be changed: {reason}. Make sure that it is yours to write.</source>
        <translation>无法更改 {path}：{reason}。请确认您有写入权限。</translation>
    </message>
    <message>
        <source>{path} cannot be written: it is a folder. Name a file.</source>
        <translation>无法写入 {path}：它是文件夹。请指定文件。</translation>
    </message>
    <message>
        <source>{path} cannot be written: {reason} What was there before is unchanged.</source>
        <translation>无法写入 {path}：{reason}原有内容未变。</translation>
    </message>
    <message>
        <source>{path} does not hold all that the tip was computed from: it is of an earlier version of the program, or was changed. Calibrate from the images.</source>
        <translation>{path} 未包含计算测头所用的全部数据：它来自较早版本的程序，或被改动过。请用图像标定。</translation>
    </message>
    <message>
        <source>{path} is damaged. Restore it from a copy.</source>
        <translation>{path} 已损坏。请用备份恢复。</translation>
    </message>
    <message>
        <source>{path} is no record of a calibration. Give what the command calibrate wrote, or an accepted result.</source>
        <translation>{path} 不是标定记录。请给出 calibrate 命令写出的文件，或已接受的结果。</translation>
    </message>
    <message>
        <source>{path} is not as it was recorded (wrong checksum). Restore it from a copy.</source>
        <translation>{path} 与记录时不同（校验和错误）。请用备份恢复。</translation>
    </message>
    <message>
        <source>{path} is of several cameras or two cones; only the record of one camera and one cone is enough by itself. Calibrate from the images.</source>
        <translation>{path} 来自多台相机或两个锥孔；只有单相机、单锥孔的标定数据本身才足以重新计算。请用图像标定。</translation>
    </message>
    <message>
        <source>{path} is of several cameras; only calibrations of a single camera are solved again. Leave it out.</source>
        <translation>{path} 来自多台相机；只能重新求解单台相机的标定。请将其去掉。</translation>
    </message>
    <message>
        <source>{path} was written by a later version of the program (format {number}; this version reads up to {known}). Open the record with that version.</source>
        <translation>{path} 由更新版本的程序写入（格式 {number}；本版本最高读取 {known}）。请用该版本打开此记录。</translation>
    </message>
    <message>
        <source>{place} has no {key}, or one that is no text. Add it.</source>
        <translation>{place}没有 {key}，或者它不是文本。请补上。</translation>
    </message>
    <message>
        <source>{place} holds no images of two cameras. Give a folder with one folder for each camera in it, named as in the rig file: {names}.</source>
        <translation>{place} 中没有两台相机的图像。请指定一个文件夹，其中每台相机各有一个文件夹，名称与相机组文件中的相同：{names}。</translation>
    </message>
    <message>
        <source>{place} holds no images. Choose a recording that holds some.</source>
        <translation>{place} 中没有图像。请选择有图像的录制。</translation>
    </message>
    <message>
        <source>{place} holds the images of {n_given} cameras, and the tip is verified by {n_cameras}. Give the camera file, or the rig file, of these images.</source>
        <translation>{place} 中有 {n_given} 台相机的图像，而验证测头用的是 {n_cameras} 台。请指定这些图像的相机文件或相机组文件。</translation>
    </message>
    <message>
        <source>{place} is no mapping with name, intrinsics and cam_from_rig.</source>
        <translation>{place}不是包含 name、intrinsics 和 cam_from_rig 的映射。</translation>
    </message>
    <message>
        <source>{place} is no mapping. Write it as {{&quot;led&quot;: 1, &quot;x&quot;: 0, &quot;y&quot;: 0, &quot;z&quot;: -30}}.</source>
        <translation>{place} 不是映射。请写成 {{&quot;led&quot;: 1, &quot;x&quot;: 0, &quot;y&quot;: 0, &quot;z&quot;: -30}}。</translation>
    </message>
    <message>
        <source>{place} is the reference of the rig, where it stands is exact. Remove its {key}.</source>
        <translation>{place}是相机组的基准，其位置没有不确定度。请删除它的 {key}。</translation>
    </message>
    <message>
        <source>{place}: the normal {normal} does not have the length 1. Correct it, or leave the normals away if all discs face +z.</source>
        <translation>{place}：法向量 {normal} 的长度不为 1。请改正；若所有发光面都朝 +z，可以不给法向量。</translation>
    </message>
    <message>
        <source>{posture} has {n_touches} touches that can be used, {needed} are needed in each posture.</source>
        <translation>{posture} 有 {n_touches} 次可用的触测，每个姿态需要 {needed} 次。</translation>
    </message>
    <message>
        <source>{reason}. Choose another folder or name.</source>
        <translation>{reason}。请选择其他文件夹或名称。</translation>
    </message>
    <message>
        <source>{run} has {n_touches} touches that can be used; a circle needs at least {needed}, 20 are usual. Touch the ring all round.</source>
        <translation>{run} 有 {n_touches} 次可用的触测；圆至少需要 {needed} 次，通常为 20 次。请沿环一周触测。</translation>
    </message>
    <message>
        <source>{run} has {n_touches} touches that can be used; a length needs both its ends. Touch each end once at least.</source>
        <translation>{run} 有 {n_touches} 次可用的触测；长度需要两端。请对每一端至少触测一次。</translation>
    </message>
    <message>
        <source>{run}: none of the {n_images} images shows the pen ({why}). {advice}</source>
        <translation>{run}：{n_images} 幅图像均未显示光笔（{why}）。{advice}</translation>
    </message>
    <message>
        <source>{run}: the LED positions do not fit the images: {rms:.1f} px, {usual} px or less is usual. Check that the images are of this pen and this camera.</source>
        <translation>{run}：LED 位置与图像不符：{rms:.1f} px，通常不超过 {usual} px。请检查图像是否属于这支光笔和这台相机。</translation>
    </message>
    <message>
        <source>{text} is no board. Name it in a form such as {forms}; lengths are in mm.</source>
        <translation>{text} 不是标定板。请按如下形式命名：{forms}；长度单位为 mm。</translation>
    </message>
    <message>
        <source>{told} They have the size of {other}: the images may be given in another order than the cameras of the rig file.</source>
        <translation>{told}它们的尺寸与 {other} 相符：给出图像的顺序可能与相机组文件中相机的顺序不同。</translation>
    </message>
    <message>
        <source>{touch} lies {distance:.2f} mm from where the others are: the pen was lifted, or slipped. Touch that posture again.</source>
        <translation>{touch} 与其余各点相距 {distance:.2f} mm：光笔曾抬起或滑动。请在该姿态下重新触测。</translation>
    </message>
    <message>
        <source>{unit} is not a unit of length known here. Choose one of {known}.</source>
        <translation>{unit} 不是本程序支持的长度单位。请从 {known} 中选择。</translation>
    </message>
    <message>
        <source>{usable} (left out: {left_out})</source>
        <translation>{usable}（舍去：{left_out}）</translation>
    </message>
    <message>
        <source>{usable}; the tip needs at least {needed}. {advice}</source>
        <translation>{usable}；求测头至少需要 {needed} 幅。{advice}</translation>
    </message>
    <message>
        <source>{where} Check that it is the file of these cameras as they stand now, or calibrate the rig again.</source>
        <translation>{where}请检查该文件是否对应这些相机当前的位置，或重新标定相机组。</translation>
    </message>
    <message>
        <source>{where} {cause}</source>
        <translation>{where}{cause}</translation>
    </message>
    <message>
        <source>{where} {one} Or: {other}</source>
        <translation>{where}{one}或者：{other}</translation>
    </message>
    <message>
        <source>{why}</source>
        <translation>{why}</translation>
    </message>
    <message>
        <source>{width} x {height} px</source>
        <translation>{width} × {height} px</translation>
    </message>
</context>
<context>
    <name>history</name>
    <message>
        <source>Calibration</source>
        <translation>标定</translation>
    </message>
    <message>
        <source>Restored</source>
        <translation>重新生效</translation>
    </message>
    <message>
        <source>Refused</source>
        <translation>已拒绝</translation>
    </message>
    <message>
        <source>Set aside</source>
        <translation>已放弃</translation>
    </message>
    <message>
        <source>Taking back</source>
        <translation>撤回</translation>
    </message>
    <message>
        <source>Note</source>
        <translation>备注</translation>
    </message>
    <message>
        <source>Tip library</source>
        <translation>测头库</translation>
    </message>
    <message>
        <source>Verification</source>
        <translation>验证</translation>
    </message>
    <message>
        <source>Camera calibration</source>
        <translation>相机标定</translation>
    </message>
    <message>
        <source>Limits</source>
        <translation>限值</translation>
    </message>
    <message>
        <source>accepted</source>
        <translation>已接受</translation>
    </message>
    <message>
        <source>refused</source>
        <translation>已拒绝</translation>
    </message>
    <message>
        <source>abandoned</source>
        <translation>已放弃</translation>
    </message>
    <message>
        <source>in force</source>
        <translation>有效</translation>
    </message>
    <message>
        <source>replaced</source>
        <translation>已被取代</translation>
    </message>
    <message>
        <source>taken back</source>
        <translation>已撤回</translation>
    </message>
    <message>
        <source>to be used until {0}</source>
        <translation>可用至 {0}</translation>
    </message>
    <message>
        <source>ball {0} mm</source>
        <translation>测球 {0} mm</translation>
    </message>
    <message>
        <source>nominal centre {0} mm</source>
        <translation>标称中心 {0} mm</translation>
    </message>
    <message>
        <source>axis {0}</source>
        <translation>轴线 {0}</translation>
    </message>
    <message>
        <source>change at most {0} mm</source>
        <translation>最大变化 {0} mm</translation>
    </message>
    <message>
        <source>{0} days at most</source>
        <translation>最多 {0} 天</translation>
    </message>
    <message>
        <source>{0} swings at most</source>
        <translation>最多摆动 {0} 次</translation>
    </message>
    <message>
        <source>signed by {0}</source>
        <translation>由 {0} 签署</translation>
    </message>
    <message>
        <source>retired</source>
        <translation>已停用</translation>
    </message>
    <message>
        <source>Changed since it was entered</source>
        <translation>录入后被更改</translation>
    </message>
    <message>
        <source>kept</source>
        <translation>已保留</translation>
    </message>
</context>
<context>
    <name>opened_folder</name>
    <message>
        <source>No program here shows folders. This one is {0}</source>
        <translation>本机没有可显示文件夹的程序。该文件夹为 {0}</translation>
    </message>
</context>
<context>
    <name>paper</name>
    <message>
        <source>Misfit of each image / px</source>
        <translation>各图像的拟合误差 / px</translation>
    </message>
    <message>
        <source>rms</source>
        <translation>均方根</translation>
    </message>
    <message>
        <source>mean x</source>
        <translation>x 均值</translation>
    </message>
    <message>
        <source>mean y</source>
        <translation>y 均值</translation>
    </message>
    <message>
        <source>Residuals by LED / px</source>
        <translation>各 LED 的残差 / px</translation>
    </message>
    <message>
        <source>LED</source>
        <translation>LED</translation>
    </message>
    <message>
        <source>all</source>
        <translation>合成</translation>
    </message>
    <message>
        <source>Parts of U (k = 2) / µm</source>
        <translation>U (k = 2) 的各分量 / µm</translation>
    </message>
    <message>
        <source>Tip of each image from the cone / µm</source>
        <translation>单幅图像测头相对锥孔的偏差 / µm</translation>
    </message>
    <message>
        <source>Tip by the images so far, from the result / µm</source>
        <translation>由前 n 幅图像求得的测头与结果之差 / µm</translation>
    </message>
    <message>
        <source>U (k = 2) by the images so far / µm</source>
        <translation>由前 n 幅图像得到的 U (k = 2) / µm</translation>
    </message>
    <message>
        <source>Residuals over the image × {0}</source>
        <translation>图像上的残差 × {0}</translation>
    </message>
    <message>
        <source>residual / px</source>
        <translation>残差 / px</translation>
    </message>
    <message>
        <source>Residuals beside the normal curve</source>
        <translation>残差分布与正态曲线</translation>
    </message>
    <message>
        <source>Postures: tilt / °</source>
        <translation>姿态：倾角 / °</translation>
    </message>
    <message>
        <source>Images in each field</source>
        <translation>各区域的图像数</translation>
    </message>
    <message>
        <source>towards the camera</source>
        <translation>朝向相机</translation>
    </message>
    <message>
        <source>image</source>
        <translation>图像</translation>
    </message>
    <message>
        <source>Page {0} of {1}</source>
        <translation>第 {0} 页，共 {1} 页</translation>
    </message>
    <message>
        <source>Pen {0}, tip {1}, cone {2}</source>
        <translation>光笔 {0}，测头 {1}，锥孔 {2}</translation>
    </message>
    <message>
        <source>SHA-256 of the JSON file: {0}</source>
        <translation>JSON 文件的 SHA-256：{0}</translation>
    </message>
    <message>
        <source>No. {0}</source>
        <translation>编号 {0}</translation>
    </message>
    <message>
        <source>NOT ACCEPTED</source>
        <translation>未接受</translation>
    </message>
    <message>
        <source>Calibration record</source>
        <translation>标定记录</translation>
    </message>
    <message>
        <source>Centre of the probe tip of a light pen, by images</source>
        <translation>光笔测头中心的图像标定</translation>
    </message>
    <message>
        <source>This tip was not accepted.</source>
        <translation>该测头未被接受。</translation>
    </message>
    <message>
        <source>This tip of an earlier calibration was put in force again, with the reason: {0}</source>
        <translation>该测头为较早一次标定的结果，已重新生效，理由：{0}</translation>
    </message>
    <message>
        <source>The tip was accepted.</source>
        <translation>该测头已被接受。</translation>
    </message>
    <message>
        <source>The tip was accepted with the reason: {0}</source>
        <translation>该测头已被接受，理由：{0}</translation>
    </message>
    <message>
        <source>What was calibrated</source>
        <translation>标定对象</translation>
    </message>
    <message>
        <source>Pen, serial number</source>
        <translation>光笔序列号</translation>
    </message>
    <message>
        <source>Station</source>
        <translation>工位</translation>
    </message>
    <message>
        <source>Probe tip</source>
        <translation>测头</translation>
    </message>
    <message>
        <source>Operator</source>
        <translation>操作员</translation>
    </message>
    <message>
        <source>Ball diameter</source>
        <translation>测球直径</translation>
    </message>
    <message>
        <source>Computed</source>
        <translation>计算时间</translation>
    </message>
    <message>
        <source>Cone</source>
        <translation>锥孔</translation>
    </message>
    <message>
        <source>Accepted</source>
        <translation>接受时间</translation>
    </message>
    <message>
        <source>no</source>
        <translation>未接受</translation>
    </message>
    <message>
        <source>Images are</source>
        <translation>图像来源</translation>
    </message>
    <message>
        <source>What stands as [U+...] is the Unicode number of a character that the fonts of this paper do not have.</source>
        <translation>以 [U+...] 表示的是本记录字体所缺字符的 Unicode 编码。</translation>
    </message>
    <message>
        <source>Temperature of the pen</source>
        <translation>光笔温度</translation>
    </message>
    <message>
        <source>not measured</source>
        <translation>未测量</translation>
    </message>
    <message>
        <source>Method</source>
        <translation>方法</translation>
    </message>
    <message>
        <source>Program</source>
        <translation>程序</translation>
    </message>
    <message>
        <source>Tip / mm</source>
        <translation>测头 / mm</translation>
    </message>
    <message>
        <source>U (k = 2) / mm</source>
        <translation>U (k = 2) / mm</translation>
    </message>
    <message>
        <source>Nominal tip / mm</source>
        <translation>标称测头 / mm</translation>
    </message>
    <message>
        <source>Tip minus nominal / mm</source>
        <translation>测头与标称之差 / mm</translation>
    </message>
    <message>
        <source>Change since {0} / mm</source>
        <translation>自 {0} 以来的变化 / mm</translation>
    </message>
    <message>
        <source>its U (k = 2) / mm</source>
        <translation>其 U (k = 2) / mm</translation>
    </message>
    <message>
        <source>Result</source>
        <translation>结果</translation>
    </message>
    <message>
        <source>In the frame of the pen</source>
        <translation>光笔坐标系</translation>
    </message>
    <message>
        <source>In the frame of the camera</source>
        <translation>相机坐标系</translation>
    </message>
    <message>
        <source>Cone / mm</source>
        <translation>锥孔 / mm</translation>
    </message>
    <message>
        <source>Covariance of the tip / µm²</source>
        <translation>测头的协方差 / µm²</translation>
    </message>
    <message>
        <source>The tip is known least along ({0}) of the pen, where U (k = 2) is {1} mm. U is the standard uncertainty times k = 2, which for a normal distribution covers some 95 %, by JCGM 100:2008 (GUM).</source>
        <translation>测头沿光笔坐标系的 ({0}) 方向不确定度最大，该方向的 U (k = 2) 为 {1} mm。U 为标准不确定度乘以包含因子 k = 2，对正态分布其包含概率约为 95 %，依据 JCGM 100:2008 (GUM)。</translation>
    </message>
    <message>
        <source>No earlier tip was in force to compare with.</source>
        <translation>此前没有生效的测头可供比较。</translation>
    </message>
    <message>
        <source>To look into</source>
        <translation>需要查看</translation>
    </message>
    <message>
        <source>Tip as found / mm</source>
        <translation>标定前状态的测头 / mm</translation>
    </message>
    <message>
        <source>As found, the tip in force until then lay {0} mm from the tip as left; it had no limit of change.</source>
        <translation>标定前状态：此前有效的测头与标定后状态的测头相距 {0} mm；没有变化限值。</translation>
    </message>
    <message>
        <source>As found, the tip in force until then lay {0} mm from the tip as left, within its limit of {1} mm.</source>
        <translation>标定前状态：此前有效的测头与标定后状态的测头相距 {0} mm，在其限值 {1} mm 之内。</translation>
    </message>
    <message>
        <source>As found, the tip in force until then lay {0} mm from the tip as left, BEYOND its limit of {1} mm.</source>
        <translation>标定前状态：此前有效的测头与标定后状态的测头相距 {0} mm，超出其限值 {1} mm。</translation>
    </message>
    <message>
        <source>Odd minus even images / mm</source>
        <translation>奇数图像减偶数图像 / mm</translation>
    </message>
    <message>
        <source>Decision rule</source>
        <translation>判定规则</translation>
    </message>
    <message>
        <source>No conformity of the tip with a specification is stated. The rule is that of the program which made this paper; the verdict is that of the file.</source>
        <translation>本记录不对测头是否符合规范作出声明。判定规则取自生成本文件的程序，判定结果取自 JSON 文件。</translation>
    </message>
    <message>
        <source>assumed</source>
        <translation>假定</translation>
    </message>
    <message>
        <source>Combined standard uncertainty</source>
        <translation>合成标准不确定度</translation>
    </message>
    <message>
        <source>Expanded uncertainty U (k = 2)</source>
        <translation>扩展不确定度 U (k = 2)</translation>
    </message>
    <message>
        <source>Budget of uncertainty</source>
        <translation>不确定度报告</translation>
    </message>
    <message>
        <source>Standard uncertainty (k = 1) / µm</source>
        <translation>标准不确定度 (k = 1) / µm</translation>
    </message>
    <message>
        <source>U (k = 2), weakest direction</source>
        <translation>U (k = 2)，最弱方向</translation>
    </message>
    <message>
        <source>The parts add up in squares. Assumed is what no file states; the station or the program stands for it.</source>
        <translation>各分量按平方和合成。“假定”指文件中未给出、由工位设置或程序取定的量。</translation>
    </message>
    <message>
        <source>Images hang together: their noise counts {0} times (variance).</source>
        <translation>图像之间相关：其噪声按 {0} 倍计入（方差）。</translation>
    </message>
    <message>
        <source>Images</source>
        <translation>图像</translation>
    </message>
    <message>
        <source>Used</source>
        <translation>使用</translation>
    </message>
    <message>
        <source>{0} of {1}</source>
        <translation>{0} / {1}</translation>
    </message>
    <message>
        <source>Tilt of the pen</source>
        <translation>光笔倾角</translation>
    </message>
    <message>
        <source>{0} to {1}°</source>
        <translation>{0} 至 {1}°</translation>
    </message>
    <message>
        <source>Left out</source>
        <translation>未用</translation>
    </message>
    <message>
        <source>Turn about its axis</source>
        <translation>绕自身轴转角</translation>
    </message>
    <message>
        <source>Residuals, rms</source>
        <translation>残差，均方根</translation>
    </message>
    <message>
        <source>Noise of a centre</source>
        <translation>中心噪声</translation>
    </message>
    <message>
        <source>Residuals, largest image</source>
        <translation>残差，最大的图像</translation>
    </message>
    <message>
        <source>Tip of single images, rms</source>
        <translation>单幅图像测头，均方根</translation>
    </message>
    <message>
        <source>The tip image by image is drawn of one camera and one cone only, and of files that hold what it takes.</source>
        <translation>仅对单相机、单锥孔且内容齐全的文件绘制测头随图像的变化。</translation>
    </message>
    <message>
        <source>The curves are by the poses of single images, the result by the adjustment of all images together.</source>
        <translation>曲线由各单幅图像的位姿求得，结果由全部图像整体平差求得。</translation>
    </message>
    <message>
        <source>Images left out</source>
        <translation>未用的图像</translation>
    </message>
    <message>
        <source>Image</source>
        <translation>图像</translation>
    </message>
    <message>
        <source>File</source>
        <translation>文件</translation>
    </message>
    <message>
        <source>Why left out</source>
        <translation>未用原因</translation>
    </message>
    <message>
        <source>And {0} more, which the JSON file names.</source>
        <translation>另有 {0} 幅，见 JSON 文件。</translation>
    </message>
    <message>
        <source>LEDs and camera</source>
        <translation>LED 与相机</translation>
    </message>
    <message>
        <source>stands out</source>
        <translation>明显偏离</translation>
    </message>
    <message>
        <source>Seen</source>
        <translation>可见</translation>
    </message>
    <message>
        <source>rms / px</source>
        <translation>均方根 / px</translation>
    </message>
    <message>
        <source>mean x / px</source>
        <translation>x 均值 / px</translation>
    </message>
    <message>
        <source>mean y / px</source>
        <translation>y 均值 / px</translation>
    </message>
    <message>
        <source>off its place / µm</source>
        <translation>偏离位置 / µm</translation>
    </message>
    <message>
        <source>Camera as the images have it</source>
        <translation>由图像求得的相机参数</translation>
    </message>
    <message>
        <source>Parameter</source>
        <translation>参数</translation>
    </message>
    <message>
        <source>Value</source>
        <translation>数值</translation>
    </message>
    <message>
        <source>Standard uncertainty (k = 1)</source>
        <translation>标准不确定度 (k = 1)</translation>
    </message>
    <message>
        <source>Rig</source>
        <translation>相机组</translation>
    </message>
    <message>
        <source>Camera</source>
        <translation>相机</translation>
    </message>
    <message>
        <source>Pen</source>
        <translation>光笔</translation>
    </message>
    <message>
        <source>Files that were read</source>
        <translation>读取的文件</translation>
    </message>
    <message>
        <source>Images or files of LED centres: {0}. The JSON file names each with its SHA-256.</source>
        <translation>图像或 LED 中心文件：{0} 个。JSON 文件列出每个文件及其 SHA-256。</translation>
    </message>
    <message>
        <source>The file behind this paper</source>
        <translation>本记录所依据的文件</translation>
    </message>
    <message>
        <source>JSON file</source>
        <translation>JSON 文件</translation>
    </message>
    <message>
        <source>Entry in the archive</source>
        <translation>档案条目</translation>
    </message>
    <message>
        <source>Its SHA-256</source>
        <translation>该条目的 SHA-256</translation>
    </message>
    <message>
        <source>SHA-256 of the entry before</source>
        <translation>前一条目的 SHA-256</translation>
    </message>
    <message>
        <source>The file has no checksum: a change of it would not have been noticed.</source>
        <translation>该文件没有校验和：若被更改则无法发现。</translation>
    </message>
    <message>
        <source>All figures are of that file alone, which holds more and is the original. They relate only to the items named, as they were at that time. This is a calibration record, not a certificate of an accredited laboratory. It is to be copied whole or not at all.</source>
        <translation>全部数据仅取自该文件；该文件内容更全，为原始记录。数据仅对所列器具在当时的状态有效。本文件为标定记录，不是认可实验室出具的校准证书。不得部分复制。</translation>
    </message>
    <message>
        <source>Calibrated by</source>
        <translation>标定人</translation>
    </message>
    <message>
        <source>Checked by</source>
        <translation>核验人</translation>
    </message>
    <message>
        <source>Name, date, signature</source>
        <translation>姓名、日期、签字</translation>
    </message>
    <message>
        <source>End of the record</source>
        <translation>记录结束</translation>
    </message>
    <message>
        <source>Noise of the images</source>
        <translation>图像噪声</translation>
    </message>
    <message>
        <source>LED centres, what does not average out</source>
        <translation>LED 中心中不能被平均的误差</translation>
    </message>
    <message>
        <source>Seat of the tip in the cone</source>
        <translation>测头在锥孔中的就位</translation>
    </message>
    <message>
        <source>Form of ball and cone</source>
        <translation>测球与锥孔的形状误差</translation>
    </message>
    <message>
        <source>Drift of cone and camera</source>
        <translation>锥孔与相机的漂移</translation>
    </message>
    <message>
        <source>LED positions of the pen file</source>
        <translation>LED 文件中的 LED 位置</translation>
    </message>
    <message>
        <source>Scale of the pen file</source>
        <translation>LED 文件的尺度</translation>
    </message>
    <message>
        <source>Distance of the cones</source>
        <translation>锥孔间距</translation>
    </message>
    <message>
        <source>Diameter of the LED discs</source>
        <translation>LED 发光面直径</translation>
    </message>
    <message>
        <source>Intrinsics of the camera file</source>
        <translation>内参文件的内参</translation>
    </message>
    <message>
        <source>Places of the cameras</source>
        <translation>各相机的位置</translation>
    </message>
    <message>
        <source>Effects too uncertain to be fitted</source>
        <translation>尚不确定而未拟合的影响</translation>
    </message>
    <message>
        <source>joint adjustment of all images</source>
        <translation>全部图像整体平差</translation>
    </message>
    <message>
        <source>two-stage, as published by S. Liu et al. (2013)</source>
        <translation>两步法，S. Liu 等 (2013)</translation>
    </message>
    <message>
        <source>none</source>
        <translation>无</translation>
    </message>
    <message>
        <source>not stated</source>
        <translation>未注明</translation>
    </message>
</context>
<context>
    <name>phrases</name>
    <message>
        <source>Show the pen</source>
        <translation>让相机看到光笔</translation>
    </message>
    <message>
        <source>Seat the tip</source>
        <translation>测头就位</translation>
    </message>
    <message>
        <source>Seat and swing</source>
        <translation>就位并摆动</translation>
    </message>
    <message>
        <source>Seated</source>
        <translation>已就位</translation>
    </message>
    <message>
        <source>{0} Review has their reasons.</source>
        <translation>{0}原因见“复核”步骤。</translation>
    </message>
    <message>
        <source>{0} Accept it at the screen.</source>
        <translation>{0}请在屏幕上点击“接受”。</translation>
    </message>
    <message>
        <source>centres</source>
        <translation>中心</translation>
    </message>
    <message>
        <source>The LED table is not that of the file in use: save or discard it.</source>
        <translation>LED 表与正在使用的文件不同：请保存或放弃。</translation>
    </message>
    <message>
        <source>Keep the tip pressed into the cone.</source>
        <translation>保持测头压紧在锥孔中。</translation>
    </message>
    <message>
        <source>Lean RIGHT</source>
        <translation>朝自己右侧倾斜</translation>
    </message>
    <message>
        <source>Follow the arrow</source>
        <translation>跟随箭头</translation>
    </message>
    <message>
        <source>Show the LEDs</source>
        <translation>露出 LED</translation>
    </message>
    <message>
        <source>Slower</source>
        <translation>慢一点</translation>
    </message>
    <message>
        <source>LEDs do not fit</source>
        <translation>LED 不匹配</translation>
    </message>
    <message>
        <source>Tip slipped</source>
        <translation>测头滑动</translation>
    </message>
    <message>
        <source>Pen not seen</source>
        <translation>看不到光笔</translation>
    </message>
    <message>
        <source>Paused</source>
        <translation>已暂停</translation>
    </message>
    <message>
        <source>Tip not in place</source>
        <translation>测头不在原位</translation>
    </message>
    <message>
        <source>Press Space to go on.</source>
        <translation>按空格键继续。</translation>
    </message>
    <message>
        <source>Captured</source>
        <translation>采集完毕</translation>
    </message>
    <message>
        <source>Starts in {seconds}</source>
        <translation>{seconds} 秒后开始</translation>
    </message>
    <message>
        <source>Reading</source>
        <translation>读取中</translation>
    </message>
    <message>
        <source>More images</source>
        <translation>继续采集</translation>
    </message>
    <message>
        <source>Lean further</source>
        <translation>再倾斜一些</translation>
    </message>
    <message>
        <source>Hold it upright</source>
        <translation>竖直握住</translation>
    </message>
    <message>
        <source>Not known yet</source>
        <translation>尚未确定</translation>
    </message>
    <message>
        <source>Not certain enough</source>
        <translation>不确定度过大</translation>
    </message>
    <message>
        <source>Halves differ</source>
        <translation>奇偶结果不一致</translation>
    </message>
    <message>
        <source>Many images dropped</source>
        <translation>丢弃图像过多</translation>
    </message>
    <message>
        <source>LED out of place</source>
        <translation>LED 位置不符</translation>
    </message>
    <message>
        <source>Files not certain enough</source>
        <translation>文件不够精确</translation>
    </message>
    <message>
        <source>File does not fit</source>
        <translation>文件不符</translation>
    </message>
    <message>
        <source>Camera or cone moved</source>
        <translation>相机或锥孔移动</translation>
    </message>
    <message>
        <source>Not at the same time</source>
        <translation>拍摄不同时</translation>
    </message>
    <message>
        <source>Tip has changed</source>
        <translation>测头有变化</translation>
    </message>
    <message>
        <source>Nothing to compare with</source>
        <translation>无从比较</translation>
    </message>
    <message>
        <source>No tip found</source>
        <translation>未求得测头</translation>
    </message>
    <message>
        <source>Good</source>
        <translation>良好</translation>
    </message>
    <message>
        <source>noise</source>
        <translation>噪声</translation>
    </message>
    <message>
        <source>ball, cone</source>
        <translation>球与锥孔</translation>
    </message>
    <message>
        <source>warmth</source>
        <translation>温度</translation>
    </message>
    <message>
        <source>cone distance</source>
        <translation>锥孔间距</translation>
    </message>
    <message>
        <source>seat</source>
        <translation>就位</translation>
    </message>
    <message>
        <source>drift</source>
        <translation>漂移</translation>
    </message>
    <message>
        <source>LEDs</source>
        <translation>LED</translation>
    </message>
    <message>
        <source>scale</source>
        <translation>尺度</translation>
    </message>
    <message>
        <source>discs</source>
        <translation>发光面</translation>
    </message>
    <message>
        <source>camera</source>
        <translation>相机</translation>
    </message>
    <message>
        <source>rig</source>
        <translation>相机组</translation>
    </message>
    <message>
        <source>doubt</source>
        <translation>存疑</translation>
    </message>
    <message>
        <source>Enter the name of the station.</source>
        <translation>请填写工位名称。</translation>
    </message>
    <message>
        <source>Enter the name of the operator.</source>
        <translation>请填写操作员姓名。</translation>
    </message>
    <message>
        <source>Enter the serial number of the pen.</source>
        <translation>请填写光笔序列号。</translation>
    </message>
    <message>
        <source>Enter the name of the probe tip.</source>
        <translation>请填写测头名称。</translation>
    </message>
    <message>
        <source>Enter the name of the cone.</source>
        <translation>请填写锥孔名称。</translation>
    </message>
    <message>
        <source>Choose the folder of the recorded images.</source>
        <translation>请选择录制图像的文件夹。</translation>
    </message>
    <message>
        <source>Search for the camera and choose it.</source>
        <translation>请搜索并选择相机。</translation>
    </message>
    <message>
        <source>No image has come from the camera yet.</source>
        <translation>相机还没有送来图像。</translation>
    </message>
    <message>
        <source>Open the intrinsics file.</source>
        <translation>请打开内参文件。</translation>
    </message>
    <message>
        <source>The intrinsics file is for images of another size.</source>
        <translation>内参文件适用于其他图像尺寸。</translation>
    </message>
    <message>
        <source>Choose the second camera.</source>
        <translation>选择第二台相机。</translation>
    </message>
    <message>
        <source>The second camera is not open yet.</source>
        <translation>第二台相机尚未打开。</translation>
    </message>
    <message>
        <source>Open the rig file of both cameras.</source>
        <translation>打开两台相机的相机组文件。</translation>
    </message>
    <message>
        <source>The rig file is not of two cameras.</source>
        <translation>该相机组文件不是两台相机的文件。</translation>
    </message>
    <message>
        <source>The rig file has another image size for the second camera.</source>
        <translation>相机组文件中第二台相机的图像尺寸与实际不同。</translation>
    </message>
    <message>
        <source>Open the LED geometry file.</source>
        <translation>请打开 LED 几何文件。</translation>
    </message>
    <message>
        <source>WAITING</source>
        <translation>等待</translation>
    </message>
    <message>
        <source>PEN SEEN</source>
        <translation>看到光笔</translation>
    </message>
    <message>
        <source>SEATED</source>
        <translation>已就位</translation>
    </message>
    <message>
        <source>READY</source>
        <translation>就绪</translation>
    </message>
    <message>
        <source>CAPTURING</source>
        <translation>采集中</translation>
    </message>
    <message>
        <source>PAUSED</source>
        <translation>已暂停</translation>
    </message>
    <message>
        <source>COMPUTING</source>
        <translation>计算中</translation>
    </message>
    <message>
        <source>NO TIP</source>
        <translation>无结果</translation>
    </message>
    <message>
        <source>PEN LOST</source>
        <translation>光笔丢失</translation>
    </message>
    <message>
        <source>LIFTED</source>
        <translation>已抬起</translation>
    </message>
    <message>
        <source>TIP MOVED</source>
        <translation>测头移位</translation>
    </message>
    <message>
        <source>LIVE CAMERA</source>
        <translation>实时相机</translation>
    </message>
    <message>
        <source>RECORDED</source>
        <translation>录制图像</translation>
    </message>
    <message>
        <source>SIMULATED</source>
        <translation>模拟</translation>
    </message>
    <message>
        <source>ORIGIN NOT STATED</source>
        <translation>来源未注明</translation>
    </message>
    <message>
        <source>PASS</source>
        <translation>合格</translation>
    </message>
    <message>
        <source>CHECK</source>
        <translation>需检查</translation>
    </message>
    <message>
        <source>REPEAT</source>
        <translation>重做</translation>
    </message>
    <message>
        <source>Lean right</source>
        <translation>向右倾斜</translation>
    </message>
    <message>
        <source>Away, right</source>
        <translation>向右前倾斜</translation>
    </message>
    <message>
        <source>Lean away</source>
        <translation>向前倾斜</translation>
    </message>
    <message>
        <source>Away, left</source>
        <translation>向左前倾斜</translation>
    </message>
    <message>
        <source>Lean left</source>
        <translation>向左倾斜</translation>
    </message>
    <message>
        <source>To you, left</source>
        <translation>向左后倾斜</translation>
    </message>
    <message>
        <source>Lean to you</source>
        <translation>向后倾斜</translation>
    </message>
    <message>
        <source>To you, right</source>
        <translation>向右后倾斜</translation>
    </message>
    <message>
        <source>A little. Keep the tip pressed in.</source>
        <translation>稍微倾斜。保持测头压紧。</translation>
    </message>
    <message>
        <source>Far. Keep the tip pressed in.</source>
        <translation>多倾斜一些。保持测头压紧。</translation>
    </message>
    <message>
        <source>to the right</source>
        <translation>向右</translation>
    </message>
    <message>
        <source>away to the right</source>
        <translation>向右前</translation>
    </message>
    <message>
        <source>away from you</source>
        <translation>向前（远离您）</translation>
    </message>
    <message>
        <source>away to the left</source>
        <translation>向左前</translation>
    </message>
    <message>
        <source>to the left</source>
        <translation>向左</translation>
    </message>
    <message>
        <source>towards you to the left</source>
        <translation>向左后</translation>
    </message>
    <message>
        <source>towards you</source>
        <translation>向后（朝向您）</translation>
    </message>
    <message>
        <source>towards you to the right</source>
        <translation>向右后</translation>
    </message>
    <message>
        <source>Upright</source>
        <translation>竖直</translation>
    </message>
    <message>
        <source>Turn it counter-clockwise, seen from above.</source>
        <translation>从上方看，逆时针转动。</translation>
    </message>
    <message>
        <source>Turn it clockwise, seen from above.</source>
        <translation>从上方看，顺时针转动。</translation>
    </message>
    <message>
        <source>1 image</source>
        <translation>1 幅图像</translation>
    </message>
    <message>
        <source>{0} images</source>
        <translation>{0} 幅图像</translation>
    </message>
    <message>
        <source>IN FORCE</source>
        <translation>已生效</translation>
    </message>
    <message>
        <source>PRACTICE KEPT</source>
        <translation>练习已保存</translation>
    </message>
    <message>
        <source>A simulated tip is in force for no pen; it is kept apart.</source>
        <translation>模拟测头不对任何光笔生效，单独保存。</translation>
    </message>
</context>
<context>
    <name>sounds</name>
    <message>
        <source>none of {0} is installed</source>
        <translation>未安装 {0} 中的任何一个</translation>
    </message>
</context>
<context>
    <name>standing</name>
    <message>
        <source>valid</source>
        <translation>有效</translation>
    </message>
    <message>
        <source>OVERDUE</source>
        <translation>已到期</translation>
    </message>
    <message>
        <source>NOT CALIBRATED</source>
        <translation>未标定</translation>
    </message>
    <message>
        <source>RETIRED</source>
        <translation>已停用</translation>
    </message>
    <message>
        <source>Pen {0}</source>
        <translation>光笔{0}</translation>
    </message>
    <message>
        <source>Tip {0}</source>
        <translation>测头{0}</translation>
    </message>
    <message>
        <source>Cone {0}</source>
        <translation>锥孔{0}</translation>
    </message>
</context>
<context>
    <name>words</name>
    <message>
        <source>, </source>
        <translation>，</translation>
    </message>
</context>
</TS>
