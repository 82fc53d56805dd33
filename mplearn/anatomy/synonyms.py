"""What stems of labels mean: landmarks of the table ``landmarks`` by the names that systems give.

Sources: Plug-in Gait and its medial markers (Vicon Nexus), the Helen Hayes sets of Motion Analysis
and OpenSim's models, Qualisys' CAST and Sports sets, BTS' Davis set, Rizzoli's leg set, Motive's
baseline set, OpenCap, and the points of OpenPose, COCO and MediaPipe. Names after [Cappozzo1995]
and [Wu2002], [Wu2005] where they have one. Stems are in small letters and digits, without the side.
"""

# markers on the skin, with a side
SKIN_SIDED = {
    "head_front": "fhd headfront frontalhead frhead",
    "head_rear": "bhd headback rearhead headrear",
    "head_side": "head hd headside had templ temple hae sgl",
    "ear": "ear tragus",
    "eye": "eye eyeinner",
    "scapula": "bak back offset scapula scap rbak bac aai",
    "acromion": (
        "sho shoulder should acr acromion acromium acro sae sh shouldertop shoulderstudy "
        "ac acj shol"
    ),
    "shoulder_back": "shoulderback",
    "upper_arm": "upa upperarm upparm bicep biceps uarmhigh arm uarm triceps ua",
    "elbow_outer": (
        "elb elbow lelbow lelbowstudy elbowlateral elbowlat elbowout hle el latelbow "
        "lateralelbow elbl ela elbo aell"
    ),
    "elbow_inner": (
        "elbm melb melbow melbowstudy elbowmedial elbowmed elbowin hme medelbow "
        "medialelbow elbmed em eli elm"
    ),
    "forearm": "frm forearm farm fa lowerarm radius",
    "wrist_thumb": (
        "wra wristin wristradius rsp wristradial radwrist wristthumb wristmed wristmedial "
        "mwrist mwriststudy rs radialstyloid wri rad wrr lradius"
    ),
    "wrist_little": (
        "wrb wristout usp wristulna wristulnar ulnwrist wristlat wristlateral lwrist "
        "lwriststudy us ulnarstyloid uln wru"
    ),
    "wrist_back": "wrist wrs wr",
    "knuckle": "fin hand finger hm3 mcp3 hand2 hnd mhand hm han",
    "knuckle_index": "hm2 mcp2 handin hand1 index idx if2",
    "knuckle_little": "hm5 mcp5 handout pinky",
    "iliac_front": "asi asis ias fwt waistfront asisstudy sias hipfront siasis asia",
    "iliac_back": "psi psis ips bwt waistback psisstudy sips hipback",
    "iliac_crest": "ic iliaccrest crest ilcr waist waistside iliac cristailiaca ilc",
    "trochanter": "troc trochanter ftc gt gtr gtroch greatertrochanter trc tro gtro fgt grtroch",
    "thigh_outer": "thi thigh thap bar1 thighupper thigh1 thighlateral thighlat tht",
    "thigh_front": "thighfront thad thighfrontlow quad",
    "knee_outer": (
        "kne knee fle kneelat kneelateral kneeout le lfe lek latknee lateralknee "
        "kneestudy lateralepicondyle kneo knl kneeouter knee1 knel ljc"
    ),
    "knee_inner": (
        "knm mkne mknee fme kneemed kneemedial kneein me mfe mek medknee medialknee "
        "mkneestudy medialepicondyle knei kneeinner kneemedal kneem knem"
    ),
    "fibula_head": "hf fh fibulahead fax fib fibula hfb bar2",
    "tibia_top": "tt ttc tibialtuberosity tibtub tti tuberosity",
    "shank_outer": (
        "tib shank tiap shankupper shanklateral sk shanklat shank1 shankside sha shan tbr"
    ),
    "shank_front": "shn shin shinfront shankfront shinfronthigh tibia tiad",
    "ankle_outer": (
        "ank ankle fal anklelat anklelateral ankleout lm latankle lateralankle anklestudy "
        "mall malleolus lateralmalleolus anl lma lmal ankl anklel malext mlat"
    ),
    "ankle_inner": (
        "mank ankm med tam anklemed anklemedial anklein mm medankle medialankle "
        "manklestudy medialmalleolus ani mma mmal manke mmed medmal anklem"
    ),
    "heel_back": "hee heel fcc cal calc calcaneus ca heelback calcstudy hel",
    "metatarsal1": (
        "mt1 fm1 fm toein toemed toemedial met1 metatarsal1 d1m fmh forefootin mth1 "
        "toesmed 1meta toem mtp1"
    ),
    "metatarsal2": (
        "toe fm2 sm forefoot2 met2 metatarsal2 mt2 d2m met mth2 forefoot toestudy "
        "metatarsal fmt toes mid midfoot"
    ),
    "metatarsal5": (
        "mt5 fm5 vm toeout toelat toelateral met5 metatarsal5 d5m 5meta 5metastudy "
        "forefoot5 forefootout vmh mth5 toeslat smalltoe mtp5"
    ),
    "toe_tip": "toetip hlx hallux bigtoe footindex hal hx toe1 tip",
    # joints that were computed, beside the markers
    "shoulder": "sjc shoulderjc shouldercenter shouldercentre vshoulderjc",
    "elbow": "ejc elbowjc elbowcenter elbowcentre velbowjc",
    "wrist": "wjc wristjc wristcenter wristcentre vwristjc",
    "hip": "hjc hipjc hipcenter hipcentre vhipjc",
    "knee": "kjc kneejc kneecenter kneecentre vkneejc",
    "ankle": "ajc anklejc anklecenter anklecentre vanklejc",
}

# and without
SKIN_MIDDLE = {
    "head_top": "headtop tophead top vertex ver ariel htop tophd thd crown",
    "head_front": "headfront frontalhead fronthead front frhd forehead fhead glab",
    "head_rear": "headrear rearhead headback rear backhead bhead occiput",
    "nose": "nose",
    "c7": "c7 cv7 c7study spinetop backtop t1 neckback nape cerv7 cvii",
    "t2": "t2 tv2 spinethoracic2 t3",
    "t8": "t8 tv8 t7 tv7 mai t6 t5",
    "t10": "t10 tv10 strnback midback back t9",
    "l1": "t12 tv12 l1 lv1 spinethoracic12",
    "l3": "l3 lv3 l2 lv2 l4 lv4",
    "l5": "l5 lv5 l5s1",
    "jugular_notch": (
        "clav sjn ij jn sternum stern strntop clavicle suprasternal ijn manubrium "
        "incisura sternalnotch sn chest"
    ),
    "xiphoid": "strn sxs xiphoid px xip xp chest xiph proc strnlow sxp",
    "sacrum": (
        "sacr sacral vsacral vsacr sac sacrum s1 waistback vsac mpsis midpsis rootback sacro"
    ),
}

# joints, as pose estimators have them; what stands more than once may be any of these
JOINTS_SIDED = {
    "shoulder": "shoulder sho sjc shoulderjc arm upperarm",
    "elbow": "elbow elb ejc forearm elbowjc",
    "wrist": "wrist wri wjc hand wristjc",
    "hip": "hip hjc hipjc thigh upleg",
    "knee": "knee kne kjc kneejc shin leg",
    "ankle": "ankle ank ajc foot anklejc",
    "heel_back": "heel",
    "ball": "foot toe toes toebase",
    "toe_tip": "bigtoe footindex toetip foot toe toes",
    "metatarsal5": "smalltoe",
    "ear": "ear",
    "eye": "eye eyeinner",
    "hand": "hand",
    "knuckle_index": "index handindex1 indexfinger",
    "knuckle_little": "pinky handpinky1",
}

JOINTS_MIDDLE = {
    "neck": "neck",
    "nose": "nose",
    "skull": "head",
    "head_top": "headtop tophead",
    "pelvis": "midhip pelvis hip hips root midpelvis spinebase hipcenter",
}

# joints that are called after the bone below them, as skeletons have them
BONES_SIDED = {
    "shoulder": "arm upperarm uarm uparm humerus shldr",
    "elbow": "forearm foarm farm lowerarm lowarm lfarm larm radius",
    "wrist": "hand wrist",
    "hip": "upleg upperleg thigh femur",
    "knee": "leg lowerleg lowleg shin shank calf tibia",
    "ankle": "foot ankle",
    "ball": "toe toes toebase toe0 ball",
}

BONES_MIDDLE = {
    "neck": "neck neck1 lowerneck",
    "skull": "head",
}
